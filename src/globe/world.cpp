#include "globe/world.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include "fetch/transfer.h"
#include "geo/body.h"
#include "globe/world_text.h"
#include "source/tiles/height_decoders.h"

namespace tellurion::globe {
namespace {

const std::initializer_list<std::string_view> kLayerKeys{"name",       "group",   "source",  "opacity", "gamma",
                                                         "multiplier", "feather", "enabled", "mode",    "attribution"};

constexpr std::string_view kGroupNames[] = {"height", "normal", "color", "grayscale", "grayscale-overlay", "water", "night", "overlay"};

/// Sources that need neither file nor server.
bool is_drawn_by_itself(const std::string& type) { return type == "tile-index" || type == "scale"; }

bool is_web_address(const std::string& text) { return text.starts_with("http://") || text.starts_with("https://"); }

bool is_archive(const std::string& type) { return type == "mbtiles" || type == "geopackage" || type == "pmtiles"; }

/// Reads the tables of one world file; the first mistake is kept, what follows it is ignored.
class WorldReader {
 public:
  WorldReader(std::filesystem::path folder, std::string name) : folder_(std::move(folder)), name_(std::move(name)) {}

  Result<World> read(const toml::table& root) {
    World world;
    expect_keys(root, "the file", {"planet", "layer"});
    if (const toml::node* planet = root.get("planet")) {
      if (const toml::table* table = planet->as_table()) read_planet(*table, world);
      else fail(*planet, "`planet` must be a table: [planet]");
    }
    if (const toml::node* layers = root.get("layer")) {
      const toml::array* list = layers->as_array();
      if (!list) fail(*layers, "layers are written as [[layer]], with two brackets");
      for (std::size_t i = 0; list && i < list->size(); ++i) {
        const toml::table* table = (*list)[i].as_table();
        if (table) world.layers.push_back(read_layer(*table));
        else fail((*list)[i], "layers are written as [[layer]], with two brackets");
      }
    }
    if (error_) return *error_;
    return world;
  }

 private:
  void read_planet(const toml::table& table, World& world) {
    expect_keys(table, "[planet]", {"name", "radii"});
    const toml::node* radii = table.get("radii");
    world.planet = text(table, "name").value_or(radii ? "custom" : "Earth");
    if (radii) {
      const toml::array* pair = radii->as_array();
      if (!pair || pair->size() != 2 || !pair->get(0)->is_number() || !pair->get(1)->is_number())
        return fail(*radii, "`radii` must be [equatorial, polar] in metres");
      const double a = pair->get(0)->value<double>().value_or(0.0);
      const double b = pair->get(1)->value<double>().value_or(0.0);
      if (!(b > 0.0 && a >= b && a < 1e10 && b > 0.5 * a))
        return fail(*radii, "`radii` must be [equatorial, polar] in metres, the polar one from half to all of the equatorial one");
      world.ellipsoid = {Metres(a), Metres(b)};
    } else if (const auto body = geo::find_body(world.planet)) {
      world.ellipsoid = body->ellipsoid;
    } else {
      fail(*table.get("name"), fmt::format("no body is known as \"{}\": give its radii = [equatorial, polar] in metres", world.planet));
    }
  }

  LayerSpec read_layer(const toml::table& table) {
    LayerSpec layer;
    layer.line = line_of(table);
    expect_keys(table, "[[layer]]", kLayerKeys);
    const auto group = text(table, "group");
    if (!group) {
      fail(table, "the layer has no `group`");
    } else if (const auto found = group_by_name(*group)) {
      layer.group = *found;
    } else {
      fail(*table.get("group"), fmt::format("no group is called \"{}\": it is one of {}", *group, fmt::join(kGroupNames, ", ")));
    }
    layer.opacity = number(table, "opacity", 0.0, 1.0).value_or(1.0);
    layer.gamma = number(table, "gamma", kLeastGamma, kMostGamma).value_or(1.0);
    layer.multiplier = number(table, "multiplier", -kMostMultiplier, kMostMultiplier).value_or(1.0);
    for (const char* key : {"gamma", "multiplier"}) {
      if (const toml::node* node = table.get(key); node && layer.group == LayerGroup::normal) fail(*node, fmt::format("normals have no `{}`: they are directions", key));
    }
    layer.feather = number(table, "feather", 0.0, kMostFeather).value_or(0.0);
    layer.enabled = flag(table, "enabled").value_or(true);
    layer.attribution = text(table, "attribution").value_or("");
    if (const auto mode = text(table, "mode")) {
      if (*mode == "add" && layer.group == LayerGroup::height) layer.adds = true;
      else if (*mode != "replace") fail(*table.get("mode"), "`mode` is \"replace\", or for height layers \"add\"");
    }
    if (const toml::node* source = table.get("source")) {
      if (const toml::table* s = source->as_table()) read_source(*s, layer.source);
      else fail(*source, "`source` must be a table: source = { type = \"gdal\", path = \"...\" }");
    } else {
      fail(table, "the layer has no `source`");
    }
    const std::string& type = layer.source.type;
    if (layer.source.time && layer.group == LayerGroup::height) fail(table, "heights have no `time`: only pictures change with it");
    if (is_drawn_by_itself(type) && (layer.group == LayerGroup::height || layer.group == LayerGroup::normal)) fail(table, fmt::format("a source of type \"{}\" is a picture: its group is \"color\"", type));
    const std::string first_file = layer.source.catalogue.files.empty() ? "" : layer.source.catalogue.files.front();
    const std::string unnamed = type == "catalogue" && layer.source.path.empty() ? std::filesystem::path(first_file).stem().string() : !layer.source.url.empty() ? fetch::public_part(layer.source.url) : is_drawn_by_itself(type) ? type : layer.source.path.stem().string();
    layer.name = text(table, "name").value_or(unnamed);
    return layer;
  }

  void read_source(const toml::table& table, SourceSpec& source) {
    source.type = text(table, "type").value_or("gdal");
    if (source.type == "xyz") return read_tiles(table, source);
    if (source.type == "cesium-terrain") return read_terrain(table, source);
    if (source.type == "cog") return read_cog(table, source);
    if (is_archive(source.type)) return read_archive(table, source);
    if (source.is_service()) return read_service(table, source);
    if (is_drawn_by_itself(source.type)) return read_drawn(table, source);
    if (source.type == "catalogue") return read_catalogue(table, source);
    const bool image = source.type == "image";
    if (source.type != "gdal" && !image) {
      return fail(table.contains("type") ? *table.get("type") : static_cast<const toml::node&>(table),
                  fmt::format("no source is of type \"{}\": it is gdal, catalogue, image, xyz, wmts, wms, tms, cesium-terrain, mbtiles, geopackage, pmtiles, cog, tile-index or scale", source.type), ErrorCode::unsupported);
    }
    expect_keys(table, "source", {"type", "path", "time", image ? "bounds" : "crs", "vertical", "no_data", "scale", "offset", "bands"});
    if (image) source.bounds = read_bounds(table, 360.0).value_or(std::array{-180.0, -90.0, 180.0, 90.0});
    read_path(table, source);
    read_time(table, source.path.string(), source);
    read_samples(table, source);
  }

  void read_catalogue(const toml::table& table, SourceSpec& source) {
    expect_keys(table, "source", {"type", "path", "files", "order", "crs", "vertical", "no_data", "scale", "offset", "bands"});
    if (table.contains("path")) read_path(table, source);
    if (const toml::node* files = table.get("files")) {
      read_texts(*files, "files", source.catalogue.files);
      for (std::string& file : source.catalogue.files) {
        if (!is_web_address(file)) file = (folder_ / file).lexically_normal().string();
      }
    }
    if (!table.contains("path") && !table.contains("files"))
      fail(table, "a catalogue needs a `path` (a folder, a VRT, an index of gdaltindex, STAC items) or `files = [...]`");
    source.catalogue.order = text(table, "order").value_or("finest");
    if (source.catalogue.order != "finest" && source.catalogue.order != "listed") fail(*table.get("order"), "`order` is \"finest\" or \"listed\"");
    read_samples(table, source);
  }

  void read_path(const toml::table& table, SourceSpec& source) {
    if (const auto path = text(table, "path"); path && !path->empty()) source.path = (folder_ / *path).lexically_normal();
    else fail(table, "the source has no `path`");
  }

  /// What is said over what a raster says itself.
  void read_samples(const toml::table& table, SourceSpec& source) {
    source.crs = text(table, "crs");
    source.vertical = text(table, "vertical");
    constexpr double kAny = std::numeric_limits<double>::infinity();
    source.no_data = number(table, "no_data", -kAny, kAny);
    source.scale = number(table, "scale", -1e12, 1e12);
    source.offset = number(table, "offset", -1e12, 1e12);
    if (const toml::node* bands = table.get("bands")) {
      std::array<int, 3> rgb{};
      const toml::array* list = bands->as_array();
      bool good = list && list->size() == 3;
      for (std::size_t i = 0; good && i < 3; ++i) {
        const auto band = (*list)[i].value<std::int64_t>();
        good = band && *band >= 1 && *band <= 65536;
        if (good) rgb[i] = static_cast<int>(*band);
      }
      if (good) source.bands = rgb;
      else fail(*bands, "`bands` must be [red, green, blue], numbers from 1");
    }
  }

  void read_cog(const toml::table& table, SourceSpec& source) {
    expect_keys(table, "source", {"type", "url", "headers", "crs", "vertical", "no_data", "scale", "offset", "bands"});
    source.url = text(table, "url").value_or("");
    if (!is_web_address(source.url)) fail(table, "the source needs a `url` of http:// or https://, for example \"https://host/raster.tif\"");
    read_headers(table, source);
    read_samples(table, source);
  }

  void read_archive(const toml::table& table, SourceSpec& source) {
    if (source.type == "mbtiles") expect_keys(table, "source", {"type", "path", "encoding", "vertical", "bounds"});
    if (source.type == "geopackage") expect_keys(table, "source", {"type", "path", "table", "encoding", "vertical", "bounds"});
    if (source.type == "pmtiles") expect_keys(table, "source", {"type", "path", "url", "headers", "encoding", "vertical", "bounds"});
    if (table.contains("url")) {
      source.url = text(table, "url").value_or("");
      if (!is_web_address(source.url)) fail(*table.get("url"), "`url` begins with http:// or https://; a file has a `path`");
      if (table.contains("path")) fail(table, "the source has a `path` and a `url`: only one of them can be");
      read_headers(table, source);
    } else {
      read_path(table, source);
    }
    source.table = text(table, "table").value_or("");
    source.vertical = text(table, "vertical");
    read_encoding(table, source);
    source.bounds = read_bounds(table);
  }

  void read_encoding(const toml::table& table, SourceSpec& source) {
    source.encoding = text(table, "encoding").value_or("");
    if (!source.encoding.empty() && !source::is_height_encoding(source.encoding))
      fail(*table.get("encoding"), fmt::format("no encoding is called \"{}\": it is {}; without one, heights are the first band's numbers", source.encoding, source::height_encodings()));
  }

  void read_headers(const toml::table& table, SourceSpec& source) {
    const toml::node* headers = table.get("headers");
    if (!headers) return;
    const toml::table* fields = headers->as_table();
    if (!fields) return fail(*headers, "`headers` is a table: headers = { Authorization = \"...\" }");
    for (const auto& [name, value] : *fields) {
      const auto content = value.value_exact<std::string>();
      const bool good = content && (std::string(name.str()) + *content).find_first_of("\r\n") == std::string::npos;
      if (good) source.headers.emplace(name.str(), *content);
      else fail(value, fmt::format("the header `{}` must be text in quotes, on one line", name.str()));
    }
  }

  void read_tiles(const toml::table& table, SourceSpec& source) {
    expect_keys(table, "source", {"type", "url", "time", "subdomains", "headers", "projection", "encoding", "tile_size", "min_level", "max_level", "bounds", "vertical"});
    source.url = text(table, "url").value_or("");
    if (!is_web_address(source.url)) fail(table, "the source needs a `url` of http:// or https://, for example \"http://host/{z}/{x}/{y}.png\"");
    read_time(table, source.url, source);
    source.vertical = text(table, "vertical");
    read_projection(table, source);
    read_encoding(table, source);
    source.tile_size = static_cast<int>(number(table, "tile_size", 16, 4096).value_or(256));
    source.min_level = static_cast<int>(number(table, "min_level", 0, 30).value_or(0));
    source.max_level = static_cast<int>(number(table, "max_level", 0, 30).value_or(18));
    source.bounds = read_bounds(table);
    read_headers(table, source);
    if (const toml::node* list = table.get("subdomains")) read_texts(*list, "subdomains", source.subdomains);
  }

  void read_terrain(const toml::table& table, SourceSpec& source) {
    expect_keys(table, "source", {"type", "url", "headers", "tile_size", "max_level", "vertical"});
    source.url = text(table, "url").value_or("");
    if (!is_web_address(source.url)) fail(table, "the source needs the `url` of a layer.json, for example \"https://host/terrain/layer.json\"");
    source.vertical = text(table, "vertical");
    source.tile_size = static_cast<int>(number(table, "tile_size", 16, 4096).value_or(kTerrainSize));
    source.max_level = static_cast<int>(number(table, "max_level", 0, 29).value_or(kEveryLevel));
    read_headers(table, source);
  }

  void read_service(const toml::table& table, SourceSpec& source) {
    ServiceSpec& service = source.service;
    if (source.type == "wmts") {
      expect_keys(table, "source", {"type", "url", "headers", "layer", "style", "matrix_set", "format", "dimensions", "encoding", "min_level", "max_level", "bounds", "vertical"});
    } else if (source.type == "wms") {
      expect_keys(table, "source", {"type", "url", "headers", "layers", "styles", "version", "crs", "format", "transparent", "dimensions", "tile_size", "encoding",
                                    "min_level", "max_level", "bounds", "vertical"});
    } else {
      expect_keys(table, "source", {"type", "url", "headers", "encoding", "min_level", "max_level", "bounds", "vertical"});
    }
    source.url = text(table, "url").value_or("");
    if (!is_web_address(source.url)) fail(table, "the source needs a `url` of http:// or https://: that of the service or of its capabilities");
    const bool wms = source.type == "wms";
    service.layer = text(table, wms ? "layers" : "layer").value_or("");
    service.style = text(table, wms ? "styles" : "style").value_or("");
    service.matrix_set = text(table, "matrix_set").value_or("");
    service.format = text(table, "format").value_or("");
    service.version = text(table, "version").value_or("");
    if (!service.version.empty() && service.version != "1.1.1" && service.version != "1.3.0") fail(*table.get("version"), "`version` is \"1.1.1\" or \"1.3.0\"");
    service.transparent = flag(table, "transparent");
    const auto level = [&](const char* key) -> std::optional<int> {
      const auto value = number(table, key, 0, 30);
      return value ? std::optional<int>(static_cast<int>(*value)) : std::nullopt;
    };
    service.min_level = level("min_level");
    service.max_level = level("max_level");
    source.crs = text(table, "crs");
    source.vertical = text(table, "vertical");
    source.tile_size = static_cast<int>(number(table, "tile_size", 16, 4096).value_or(256));
    read_encoding(table, source);
    source.bounds = read_bounds(table);
    read_headers(table, source);
    if (const toml::node* dimensions = table.get("dimensions")) {
      const toml::table* values = dimensions->as_table();
      if (!values) return fail(*dimensions, "`dimensions` is a table: dimensions = { Time = \"2012-01-01\" }");
      for (const auto& [name, value] : *values) {
        if (const auto content = value.value_exact<std::string>()) service.dimensions.emplace(name.str(), *content);
        else fail(value, fmt::format("the dimension `{}` must be text in quotes", name.str()));
      }
    }
  }

  /// `most`: the largest longitude; beyond 180 the bounds lie across it.
  std::optional<std::array<double, 4>> read_bounds(const toml::table& table, double most = 180.0) {
    const toml::node* bounds = table.get("bounds");
    if (!bounds) return std::nullopt;
    std::array<double, 4> edges{};
    const toml::array* list = bounds->as_array();
    bool good = list && list->size() == 4;
    for (std::size_t i = 0; good && i < 4; ++i) {
      const auto edge = (*list)[i].is_number() ? (*list)[i].value<double>() : std::nullopt;
      good = edge && std::abs(*edge) <= (i % 2 == 0 ? most : 90.0);
      if (good) edges[i] = *edge;
    }
    if (good && edges[0] < edges[2] && edges[1] < edges[3] && edges[2] - edges[0] <= 360.0) return edges;
    fail(*bounds, "`bounds` must be [west, south, east, north] in degrees, west < east and south < north");
    return std::nullopt;
  }

  /// `place` is the path or URL.
  void read_time(const toml::table& table, const std::string& place, SourceSpec& source) {
    const toml::node* time = table.get("time");
    if (!time) {
      if (source.type == "xyz" && source::has_time(place)) fail(table, "the `url` has {time}: say which times there are, for example time = { values = [\"2019\", \"2020\"], format = \"%Y\" }");
      return;
    }
    const toml::table* fields = time->as_table();
    if (!fields) return fail(*time, "`time` is a table: time = { start = \"2020-01-01\", end = \"2020-12-31\", step = \"P1D\", format = \"%Y-%m-%d\" }");
    expect_keys(*fields, "time", {"format", "values", "start", "end", "step"});
    source::TimeSpec spec;
    spec.format = text(*fields, "format").value_or(spec.format);
    spec.start = text(*fields, "start").value_or("");
    spec.end = text(*fields, "end").value_or("");
    spec.step = text(*fields, "step").value_or("");
    if (const toml::node* values = fields->get("values")) read_texts(*values, "values", spec.values);
    if (!source::has_time(place)) fail(*time, "a source with a `time` has {time} in its path or URL, where the time goes");
    if (const auto steps = source::TimeSteps::create(spec); !steps) fail(*time, steps.error().message);
    source.time = std::move(spec);
  }

  void read_texts(const toml::node& node, std::string_view key, std::vector<std::string>& texts) {
    const toml::array* list = node.as_array();
    if (!list) return fail(node, fmt::format("`{}` is a list of texts: [\"a\", \"b\"]", key));
    for (const toml::node& item : *list) {
      if (const auto value = item.value_exact<std::string>()) texts.push_back(*value);
      else fail(item, fmt::format("`{}` is a list of texts: [\"a\", \"b\"]", key));
    }
  }

  void read_drawn(const toml::table& table, SourceSpec& source) {
    if (source.type == "scale") {
      expect_keys(table, "source", {"type", "unit"});
      source.unit = text(table, "unit").value_or("km");
      if (source.unit != "m" && source.unit != "km") fail(*table.get("unit"), "`unit` is \"m\" or \"km\"");
      return;
    }
    expect_keys(table, "source", {"type", "projection", "tile_size"});
    read_projection(table, source);
    source.tile_size = static_cast<int>(number(table, "tile_size", 32, 1024).value_or(256));
  }

  void read_projection(const toml::table& table, SourceSpec& source) {
    source.projection = text(table, "projection").value_or("web-mercator");
    if (source.projection != "web-mercator" && source.projection != "geographic")
      fail(*table.get("projection"), "`projection` is \"web-mercator\" or \"geographic\"");
  }

  std::optional<std::string> text(const toml::table& table, std::string_view key) {
    const toml::node* node = table.get(key);
    if (!node) return std::nullopt;
    auto value = node->value_exact<std::string>();
    if (!value) fail(*node, fmt::format("`{}` must be text in quotes", key));
    return value;
  }

  std::optional<double> number(const toml::table& table, std::string_view key, double least, double most) {
    const toml::node* node = table.get(key);
    if (!node) return std::nullopt;
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !(*value >= least && *value <= most)) {
      fail(*node, fmt::format("`{}` must be a number from {} to {}", key, least, most));
      return std::nullopt;
    }
    return value;
  }

  std::optional<bool> flag(const toml::table& table, std::string_view key) {
    const toml::node* node = table.get(key);
    if (!node) return std::nullopt;
    auto value = node->value_exact<bool>();
    if (!value) fail(*node, fmt::format("`{}` must be true or false", key));
    return value;
  }

  void expect_keys(const toml::table& table, std::string_view where, std::initializer_list<std::string_view> known) {
    for (const auto& [key, node] : table) {
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        fail(node, fmt::format("{} has no key `{}`{}; it knows {}", where, key.str(), is_layers(where, key.str()) ? ", which the [[layer]] has" : "",
                               fmt::join(known, ", ")));
    }
  }

  static bool is_layers(std::string_view where, std::string_view key) {
    return where == "source" && std::find(kLayerKeys.begin(), kLayerKeys.end(), key) != kLayerKeys.end();
  }

  static int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

  void fail(const toml::node& node, std::string_view what, ErrorCode code = ErrorCode::invalid_argument) {
    if (!error_) error_ = Error{code, fmt::format("{}:{}: {}", name_, line_of(node), what)};
  }

  std::filesystem::path folder_;
  std::string name_;
  std::optional<Error> error_;
};

}  // namespace

std::string_view name_of(LayerGroup group) { return kGroupNames[static_cast<std::size_t>(group)]; }

std::optional<LayerGroup> group_by_name(std::string_view name) {
  const auto* found = std::ranges::find(kGroupNames, name);
  if (found == std::end(kGroupNames)) return std::nullopt;
  return static_cast<LayerGroup>(found - std::begin(kGroupNames));
}

std::string data_name(const SourceSpec& source) { return source.url.empty() ? source.path.string() : fetch::public_part(source.url); }

Result<World> parse_world(std::string_view text, const std::filesystem::path& folder, const std::string& name) {
  try {
    const toml::table root = toml::parse(text, name);
    return WorldReader(folder, name).read(root);
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::corrupt,
                 fmt::format("{}:{}: not valid TOML: {}", name, error.source().begin.line, error.description())};
  }
}

Result<void> check(const LayerSettings& settings, LayerGroup group) {
  const auto out_of_range = [](const char* key, double value, double least, double most) -> Result<void> {
    if (value >= least && value <= most) return {};
    return {ErrorCode::invalid_argument, fmt::format("`{}` is {} to {}, not {}", key, least, most, value)};
  };
  if (auto fine = out_of_range("opacity", settings.opacity, 0.0, 1.0); !fine) return fine;
  if (auto fine = out_of_range("gamma", settings.gamma, kLeastGamma, kMostGamma); !fine) return fine;
  if (auto fine = out_of_range("multiplier", settings.multiplier, -kMostMultiplier, kMostMultiplier); !fine) return fine;
  if (group == LayerGroup::normal && (settings.gamma != 1.0 || settings.multiplier != 1.0))
    return {ErrorCode::invalid_argument, "normals have no `gamma` and no `multiplier`: they are directions"};
  if (auto fine = out_of_range("feather", settings.feather, 0.0, kMostFeather); !fine) return fine;
  if (settings.adds && group != LayerGroup::height) return {ErrorCode::invalid_argument, "only heights are added to those below"};
  return {};
}

Result<World> load_world(const std::filesystem::path& file) {
  const auto text = read_whole(file);
  if (!text) return text.error();
  std::error_code failure;
  const auto absolute = std::filesystem::absolute(file, failure);
  auto world = parse_world(*text, absolute.parent_path(), file.string());
  if (world) world->file = absolute;
  return world;
}

Result<std::filesystem::path> default_data_folder() {
  std::vector<std::filesystem::path> places;
  if (const char* set = std::getenv("TELLURION_DATA_DIR")) places.emplace_back(std::filesystem::path(set) / "earth");
  std::error_code failure;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", failure);
  if (!failure) places.push_back(program.parent_path().parent_path() / "share/tellurion/earth");
  places.emplace_back(std::filesystem::path(TELLURION_SOURCE_DATA_DIR) / "earth");
  std::string looked;
  for (const auto& place : places) {
    if (std::filesystem::exists(place / "world.toml", failure)) return place;
    looked += (looked.empty() ? "" : ", ") + place.string();
  }
  return Error{ErrorCode::not_found,
               fmt::format("the default world is not there (looked in {}): set TELLURION_DATA_DIR to the folder that holds it", looked)};
}

}  // namespace tellurion::globe
