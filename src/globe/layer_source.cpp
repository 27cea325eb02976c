#include "globe/layer_source.h"

#include <string>
#include <vector>

#include <fmt/format.h>

#include "source/debug/scale_reference.h"
#include "source/debug/tile_index.h"
#include "source/gdal/gdal_source.h"
#include "source/tiles/cesium_terrain.h"
#include "source/tiles/service_source.h"
#include "source/tiles/tile_archive.h"
#include "source/tiles/tiled_source.h"

namespace tellurion::globe {
namespace {

source::SampleKind kind_of(LayerGroup group) {
  if (group == LayerGroup::height) return source::SampleKind::height;
  const bool is_grey = group == LayerGroup::grayscale || group == LayerGroup::grayscale_overlay || group == LayerGroup::water;
  return is_grey ? source::SampleKind::grey : source::SampleKind::colour;
}

source::GdalOptions gdal_options(const LayerSpec& layer) {
  source::GdalOptions options;
  options.path = layer.source.path.string();
  options.kind = kind_of(layer.group);
  options.crs = layer.source.crs;
  options.vertical = layer.source.vertical;
  options.no_data = layer.source.no_data;
  options.scale = layer.source.scale;
  options.offset = layer.source.offset;
  options.rgb_bands = layer.source.bands;
  options.bounds = layer.source.bounds;
  return options;
}

std::vector<std::string> header_lines(const SourceSpec& source) {
  std::vector<std::string> lines;
  for (const auto& [name, value] : source.headers) lines.push_back(name + ": " + value);
  return lines;
}

source::CesiumTerrain cesium_terrain(const LayerSpec& layer) {
  const SourceSpec& source = layer.source;
  source::CesiumTerrain terrain;
  terrain.url = source.url;
  terrain.headers = header_lines(source);
  terrain.tile_size = source.tile_size;
  if (source.max_level != kEveryLevel) terrain.max_zoom = source.max_level;
  terrain.vertical = source.vertical;
  return terrain;
}

source::TileArchive tile_archive(const LayerSpec& layer) {
  const SourceSpec& source = layer.source;
  source::TileArchive archive;
  archive.file = source.path;
  archive.url = source.url;
  archive.headers = header_lines(source);
  archive.table = source.table;
  archive.kind = kind_of(layer.group);
  archive.encoding = source.encoding;
  archive.bounds = source.bounds;
  archive.vertical = source.vertical;
  return archive;
}

source::TileService tile_service(const LayerSpec& layer) {
  const SourceSpec& source = layer.source;
  source::TileService service;
  service.url = source.url;
  service.subdomains = source.subdomains;
  service.headers = header_lines(source);
  service.scheme = source.projection == "geographic" ? source::TileScheme::geographic : source::TileScheme::web_mercator;
  service.kind = kind_of(layer.group);
  service.encoding = source.encoding;
  service.tile_size = source.tile_size;
  service.min_zoom = source.min_level;
  service.max_zoom = source.max_level;
  service.vertical = source.vertical;
  service.bounds = source.bounds;
  return service;
}

source::ServiceOptions service_options(const LayerSpec& layer) {
  const SourceSpec& source = layer.source;
  source::ServiceOptions options;
  options.url = source.url;
  options.headers = header_lines(source);
  options.kind = kind_of(layer.group);
  options.encoding = source.encoding;
  options.layer = source.service.layer;
  options.style = source.service.style;
  options.matrix_set = source.service.matrix_set;
  options.format = source.service.format;
  options.dimensions = source.service.dimensions;
  options.version = source.service.version;
  options.crs = source.crs.value_or("");
  options.transparent = source.service.transparent;
  options.tile_size = source.tile_size;
  options.least_level = source.service.min_level;
  options.most_level = source.service.max_level;
  options.bounds = source.bounds;
  options.vertical = source.vertical;
  return options;
}

Result<std::unique_ptr<source::RasterSource>> open_any(const LayerSpec& spec, const geo::Ellipsoid& world, const std::filesystem::path& cache_folder,
                                                       const std::function<std::shared_ptr<fetch::ByteStore>()>& needed_store) {
  const std::string& type = spec.source.type;
  if (type == "xyz") return source::open_tiles(tile_service(spec), world, needed_store());
  if (type == "cesium-terrain") {
    if (spec.group != LayerGroup::height)
      return Error{ErrorCode::invalid_argument, fmt::format("{}: holds heights: its layer's group is \"height\"", fetch::public_part(spec.source.url))};
    return source::open_cesium_terrain(cesium_terrain(spec), world, needed_store());
  }
  if (type == "wmts") return source::open_wmts(service_options(spec), world, needed_store());
  if (type == "wms") return source::open_wms(service_options(spec), world, needed_store());
  if (type == "tms") return source::open_tms(service_options(spec), world, needed_store());
  if (type == "mbtiles") return source::open_mbtiles(tile_archive(spec), world);
  if (type == "geopackage") return source::open_geopackage(tile_archive(spec), world);
  if (type == "pmtiles") return source::open_pmtiles(tile_archive(spec), world, spec.source.url.empty() ? nullptr : needed_store());
  if (spec.source.type == "tile-index") return source::open_tile_index({spec.source.projection == "geographic", spec.source.tile_size}, world);
  if (spec.source.type == "scale") return source::open_scale_reference(spec.source.unit == "m" ? source::ScaleUnit::metres : source::ScaleUnit::kilometres, world);
  source::GdalOptions how = gdal_options(spec);
  if (type == "cog") {
    how.path = spec.source.url;
    return source::open_cog(how, header_lines(spec.source), world, needed_store());
  }
  if (!cache_folder.empty()) how.unpack_folder = (cache_folder / "unpacked").string();
  return source::open_gdal(how, world);
}

}  // namespace

Result<std::unique_ptr<source::RasterSource>> open_layer_source(const LayerSpec& spec, const geo::Ellipsoid& world, const std::filesystem::path& cache_folder,
                                                                const std::function<std::shared_ptr<fetch::ByteStore>()>& needed_store) {
  auto opened = open_any(spec, world, cache_folder, needed_store);
  if (!opened || spec.group != LayerGroup::normal) return opened;
  const source::RasterDescription& about = (*opened)->description();
  if (about.band_count >= 3 && about.sample_type == "Byte") return opened;
  return Error{ErrorCode::invalid_argument, fmt::format("{}: has {} band{} of {}; normals are three of Byte: (n + 1) / 2 * 255 to the east, to the north and up", about.name,
                                                        about.band_count, about.band_count == 1 ? "" : "s", about.sample_type)};
}

}  // namespace tellurion::globe
