// What a command line's WORLD means.
#include "globe/world.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "geo/body.h"
#include "fetch/transfer.h"
#include "source/catalogue/listing.h"
#include "source/gdal/raster_body.h"
#include "source/tiles/tile_template.h"

namespace tellurion::globe {
namespace {

LayerGroup group_of(source::SampleKind kind) {
  switch (kind) {
    case source::SampleKind::height: return LayerGroup::height;
    case source::SampleKind::grey: return LayerGroup::grayscale;
    case source::SampleKind::colour: break;
  }
  return LayerGroup::color;
}

Result<World> default_world() {
  auto folder = default_data_folder();
  if (!folder) return folder.error();
  return load_world(*folder / "world.toml");
}

/// A raster shown for itself: on its own body; on Earth over the default world.
Result<World> world_of_raster(const std::filesystem::path& file) {
  const auto raster = source::body_of_raster(file);
  if (!raster) return raster.error();
  const geo::Body* body = geo::body_like(raster->ellipsoid);
  World world;
  world.planet = body ? std::string(body->name) : "unknown body";
  world.ellipsoid = raster->ellipsoid;
  if (world.planet == "Earth") {
    auto below = default_world();
    if (!below) return below.error();
    world = std::move(*below);
    world.file.clear();
  }
  LayerSpec layer;
  layer.name = file.filename().string();
  layer.group = group_of(raster->kind);
  std::error_code failure;
  layer.source.path = std::filesystem::absolute(file, failure).lexically_normal();
  world.layers.push_back(std::move(layer));
  return world;
}

/// The type of source of a file or URL, by the end of its name; empty: none of those that hold tiles or parts.
std::string type_by_name(const std::string& name) {
  std::string ending = std::filesystem::path(name).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".mbtiles") return "mbtiles";
  if (ending == ".gpkg") return "geopackage";
  if (ending == ".pmtiles") return "pmtiles";
  return ending == ".tif" || ending == ".tiff" ? "cog" : "";
}

/// An archive of tiles, or a GeoTIFF on a server, over the default world.
Result<World> world_of_archive(const std::string& type, const std::string& url, const std::filesystem::path& file) {
  auto world = default_world();
  if (!world) return world.error();
  world->file.clear();
  LayerSpec layer;
  layer.source.type = type;
  layer.source.url = url;
  if (url.empty()) {
    std::error_code failure;
    if (!std::filesystem::exists(file, failure)) return Error{ErrorCode::not_found, fmt::format("{}: no such file", file.string())};
    layer.source.path = std::filesystem::absolute(file, failure).lexically_normal();
    layer.name = file.filename().string();
    // Of the three only GeoPackages say whether they hold heights; what else is wrong is said when the layer is opened.
    const auto raster = type == "geopackage" ? source::body_of_raster(file) : Result<source::RasterBody>(Error{});
    if (raster && raster->kind == source::SampleKind::height) layer.group = LayerGroup::height;
  } else {
    layer.name = fetch::public_part(url);
  }
  world->layers.push_back(std::move(layer));
  return world;
}

/// Tiles of colours over the default world.
Result<World> world_of_tiles(const std::string& url) {
  const std::string type = type_by_name(fetch::public_part(url));
  if (url.find('{') == std::string::npos && (type == "pmtiles" || type == "cog")) return world_of_archive(type, url, {});
  if (const auto address = source::TileTemplate::parse(url, {}); !address) return Error{address.error().code, fmt::format("{}: {}", fetch::public_part(url), address.error().message)};
  auto world = default_world();
  if (!world) return world.error();
  world->file.clear();
  LayerSpec layer;
  layer.name = fetch::public_part(url);
  layer.source.type = "xyz";
  layer.source.url = url;
  world->layers.push_back(std::move(layer));
  return world;
}

}  // namespace

Result<World> resolve_world(const std::string& argument) {
  if (argument.empty()) return default_world();
  if (argument.starts_with("http://") || argument.starts_with("https://")) return world_of_tiles(argument);
  if (argument.find("://") != std::string::npos)
    return Error{ErrorCode::unsupported, fmt::format("{}: tiles come by http:// or https:// only", fetch::public_part(argument))};
  const std::filesystem::path file(argument);
  if (file.extension() == ".toml") return load_world(file);
  const std::string type = type_by_name(argument);
  if (!type.empty() && type != "cog") return world_of_archive(type, {}, file);
  return world_of_raster(file);
}

Result<World> world_of_data(const std::string& data, bool is_list) {
  std::error_code failure;
  const std::filesystem::path path = std::filesystem::absolute(data, failure).lexically_normal();
  if (path.extension() == ".toml" || data.empty()) return Error{ErrorCode::invalid_argument, fmt::format("{}: a world file is no data of a layer; `tellurion view` opens it", data)};
  if (!is_list && !std::filesystem::is_directory(path, failure)) {
    auto world = resolve_world(data);
    if (!world) return world;
    world->layers.erase(world->layers.begin(), world->layers.end() - 1);
    return world;
  }
  const auto list = source::list_rasters(path, geo::kWgs84);  // where they lie does not matter here
  if (!list) return list.error();
  if (list->rasters.empty()) return Error{ErrorCode::invalid_argument, fmt::format("{}: there are no rasters in it", data)};
  auto world = world_of_raster(list->rasters.front().path);
  if (!world) return world;
  LayerSpec layer = world->layers.back();
  layer.name = path.stem().string();
  layer.source = {};
  layer.source.type = "catalogue";
  layer.source.path = path;
  world->layers = {layer};
  return world;
}

Result<LayerSpec> layer_for(const World& world, const World& data) {
  const LayerSpec& layer = data.layers.front();
  if (data.planet != world.planet && !(data.ellipsoid == world.ellipsoid))
    return Error{ErrorCode::invalid_argument, fmt::format("{} lies on {}, but this is a world of {}", layer.name, data.planet, world.planet)};
  return layer;
}

}  // namespace tellurion::globe
