#include "globe/world_text.h"

#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "geo/body.h"

namespace tellurion::globe {
namespace {

toml::array array_of(const std::vector<std::string>& texts) {
  toml::array list;
  for (const std::string& text : texts) list.push_back(text);
  return list;
}

void insert_time(toml::table& table, const SourceSpec& source) {
  if (!source.time) return;
  toml::table fields;
  fields.is_inline(true);
  fields.insert("format", source.time->format);
  if (!source.time->values.empty()) fields.insert("values", array_of(source.time->values));
  if (!source.time->start.empty()) fields.insert("start", source.time->start);
  if (!source.time->end.empty()) fields.insert("end", source.time->end);
  if (!source.time->step.empty()) fields.insert("step", source.time->step);
  table.insert("time", std::move(fields));
}

toml::array edges_array(const std::array<double, 4>& edges) {
  toml::array list;
  for (const double edge : edges) list.push_back(edge);
  return list;
}

toml::table texts_table(const std::map<std::string, std::string>& texts) {
  toml::table table;
  table.is_inline(true);
  for (const auto& [name, value] : texts) table.insert(name, value);
  return table;
}

/// What source_table has still to say of a WMTS, WMS or TMS.
void add_service(const SourceSpec& source, toml::table& table) {
  const ServiceSpec& service = source.service;
  const bool wms = source.type == "wms";
  const auto add = [&](const char* key, const std::string& value) {
    if (!value.empty()) table.insert(key, value);
  };
  table.insert("url", source.url);
  if (!source.headers.empty()) table.insert("headers", texts_table(source.headers));
  add(wms ? "layers" : "layer", service.layer);
  add(wms ? "styles" : "style", service.style);
  add("matrix_set", service.matrix_set);
  add("format", service.format);
  add("version", service.version);
  add("crs", source.crs.value_or(""));
  add("encoding", source.encoding);
  if (!service.dimensions.empty()) table.insert("dimensions", texts_table(service.dimensions));
  if (service.transparent) table.insert("transparent", *service.transparent);
  if (service.min_level) table.insert("min_level", *service.min_level);
  if (service.max_level) table.insert("max_level", *service.max_level);
  if (source.tile_size != SourceSpec{}.tile_size) table.insert("tile_size", source.tile_size);
  if (source.bounds) table.insert("bounds", edges_array(*source.bounds));
  if (source.vertical) table.insert("vertical", *source.vertical);
}

/// As a world file in `folder` names it.
std::string path_in(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const auto relative = path.lexically_relative(folder);
  const bool inside = !folder.empty() && !relative.empty() && *relative.begin() != "..";
  return (inside ? relative : path).generic_string();
}

/// What source_table has to say of a catalogue only.
void add_catalogue(const SourceSpec& source, const std::filesystem::path& folder, toml::table& table) {
  std::vector<std::string> files;
  for (const std::string& file : source.catalogue.files) files.push_back(name_in(file, folder));
  if (!files.empty()) table.insert("files", array_of(files));
  if (source.catalogue.order != CatalogueSpec{}.order) table.insert("order", source.catalogue.order);
}

toml::table source_table(const SourceSpec& source, const std::filesystem::path& folder) {
  toml::table table;
  table.is_inline(true);
  table.insert("type", source.type);
  if (source.is_service()) {
    add_service(source, table);
    return table;
  }
  if (source.type == "tile-index") {
    table.insert("projection", source.projection);
    table.insert("tile_size", source.tile_size);
    return table;
  }
  if (source.type == "scale") {
    table.insert("unit", source.unit);
    return table;
  }
  SourceSpec usual;
  if (source.type == "cesium-terrain") {
    usual.tile_size = kTerrainSize;
    usual.max_level = kEveryLevel;
  }
  if (!source.url.empty()) {
    table.insert("url", source.url);
  } else if (!source.path.empty() || source.type != "catalogue") {
    table.insert("path", path_in(source.path, folder));
  }
  if (source.type == "catalogue") add_catalogue(source, folder, table);
  insert_time(table, source);
  if (!source.subdomains.empty()) table.insert("subdomains", array_of(source.subdomains));
  if (!source.headers.empty()) table.insert("headers", texts_table(source.headers));
  if (!source.table.empty()) table.insert("table", source.table);
  if (source.projection != usual.projection) table.insert("projection", source.projection);
  if (!source.encoding.empty()) table.insert("encoding", source.encoding);
  if (source.tile_size != usual.tile_size) table.insert("tile_size", source.tile_size);
  if (source.min_level != usual.min_level) table.insert("min_level", source.min_level);
  if (source.max_level != usual.max_level) table.insert("max_level", source.max_level);
  if (source.bounds) table.insert("bounds", edges_array(*source.bounds));
  if (source.crs) table.insert("crs", *source.crs);
  if (source.vertical) table.insert("vertical", *source.vertical);
  if (source.no_data) table.insert("no_data", *source.no_data);
  if (source.scale) table.insert("scale", *source.scale);
  if (source.offset) table.insert("offset", *source.offset);
  if (source.bands) {
    const auto& b = *source.bands;
    table.insert("bands", toml::array{b[0], b[1], b[2]});
  }
  return table;
}

toml::table layer_table(const LayerSpec& layer, const std::filesystem::path& folder) {
  toml::table table;
  table.insert("name", layer.name);
  table.insert("group", std::string(name_of(layer.group)));
  table.insert("source", source_table(layer.source, folder));
  if (layer.opacity != 1.0) table.insert("opacity", layer.opacity);
  if (layer.gamma != 1.0) table.insert("gamma", layer.gamma);
  if (layer.multiplier != 1.0) table.insert("multiplier", layer.multiplier);
  if (layer.feather != 0.0) table.insert("feather", layer.feather);
  if (!layer.enabled) table.insert("enabled", false);
  if (layer.adds) table.insert("mode", "add");
  if (!layer.attribution.empty()) table.insert("attribution", layer.attribution);
  return table;
}

toml::table planet_table(const World& world) {
  toml::table planet;
  planet.insert("name", world.planet);
  const auto body = geo::find_body(world.planet);
  if (!body || !(body->ellipsoid == world.ellipsoid))
    planet.insert("radii", toml::array{world.ellipsoid.a(), world.ellipsoid.b()});
  return planet;
}

std::string text_of(const toml::node& node) {
  std::ostringstream out;
  out << toml::toml_formatter(node, toml::toml_formatter::default_flags & ~toml::format_flags::allow_literal_strings);
  return out.str();
}

}  // namespace

std::string name_in(const std::string& path, const std::filesystem::path& folder) {
  return path.starts_with("http://") || path.starts_with("https://") ? path : path_in(path, folder);
}

std::string to_toml(const LayerSpec& layer, const std::filesystem::path& folder) {
  return text_of(toml::table{{"layer", toml::array{layer_table(layer, folder)}}}) + "\n";
}

std::string planet_to_toml(const World& world) { return text_of(toml::table{{"planet", planet_table(world)}}) + "\n"; }

std::string to_toml(double value) { return text_of(toml::value<double>(value)); }

std::string to_toml(const std::string& text) { return text_of(toml::value<std::string>(text)); }

std::string to_toml(const World& world) {
  toml::array layers;
  for (const LayerSpec& layer : world.layers) layers.push_back(layer_table(layer, world.file.parent_path()));
  return text_of(toml::table{{"planet", planet_table(world)}, {"layer", std::move(layers)}}) + "\n";
}

Result<std::string> read_whole(const std::filesystem::path& file) {
  constexpr std::uintmax_t kLargest = 16u << 20;
  std::error_code failure;
  if (!std::filesystem::is_regular_file(file, failure))
    return Error{ErrorCode::not_found, fmt::format("{}: there is no such world file", file.string())};
  if (std::filesystem::file_size(file, failure) > kLargest)
    return Error{ErrorCode::unsupported, fmt::format("{}: a world file has at most 16 MB", file.string())};
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) return Error{ErrorCode::unavailable, fmt::format("{}: cannot be read", file.string())};
  return text.str();
}

Result<void> write_whole(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path part = file.string() + ".part";
  {
    std::ofstream stream(part, std::ios::binary);
    stream << text;
    if (!stream.flush())
      return Error{ErrorCode::unavailable, fmt::format("{}: cannot be written; is the folder there and writable?", file.string())};
  }
  std::error_code failure;
  if (const auto old = std::filesystem::status(file, failure); std::filesystem::exists(old)) std::filesystem::permissions(part, old.permissions(), failure);
  std::filesystem::rename(part, file, failure);
  if (failure) return Error{ErrorCode::unavailable, fmt::format("{}: {}", file.string(), failure.message())};
  return {};
}

Result<void> save_world(const World& world, const std::filesystem::path& file) {
  World placed = world;
  std::error_code failure;
  placed.file = std::filesystem::absolute(file, failure);
  return write_whole(file, to_toml(placed));
}

}  // namespace tellurion::globe
