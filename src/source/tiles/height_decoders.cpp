#include "source/tiles/height_decoders.h"

#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "geo/ellipsoid.h"
#include "raster/height_codes.h"
#include "raster/heightmap_tile.h"
#include "raster/quantized_mesh.h"

namespace tellurion::source {
namespace {

/// Where the rows of a tile in Web Mercator lie between its southern edge (0) and its northern (1), by latitude.
std::vector<double> mercator_rows(const TileLevel& level, int tile_height, std::int64_t row) {
  const auto latitude = [&](double rows) {
    const double y = level.corner.y - (static_cast<double>(row) * tile_height + rows) * level.pixel.y;
    return std::atan(std::sinh(y / geo::kWgs84.a()));
  };
  const double north = latitude(0), south = latitude(tile_height);
  std::vector<double> rows;
  for (int j = 0; j < tile_height; ++j) rows.push_back((latitude(j + 0.5) - south) / (north - south));
  return rows;
}

}  // namespace

bool is_height_encoding(std::string_view name) { return name == kQuantizedMesh || name == kHeightmap || raster::height_code(name); }

std::string height_encodings() { return "terrarium, terrain-rgb, centimetres, quantized-mesh or heightmap"; }

HeightDecoder height_decoder(std::string_view encoding, const TileGrid& grid) {
  const int width = grid.tile_width, height = grid.tile_height;
  if (encoding == kHeightmap) {
    return [width, height](const std::string& bytes, const TileAddress&) { return raster::decode_heightmap_tile(bytes, width, height); };
  }
  if (encoding == kQuantizedMesh) {
    // Meshes go evenly by latitude also where the tiles are cut by Web Mercator.
    std::vector<TileLevel> levels;
    if (grid.crs == "EPSG:3857") levels = grid.levels;
    return [width, height, levels = std::move(levels)](const std::string& bytes, const TileAddress& tile) -> Result<raster::HeightGrid> {
      const Result<raster::QuantizedMesh> mesh = raster::decode_quantized_mesh(bytes);
      if (!mesh) return mesh.error();
      const auto zoom = static_cast<std::size_t>(tile.zoom);
      return raster::rasterise(*mesh, width, zoom < levels.size() ? mercator_rows(levels[zoom], height, tile.row) : raster::even_rows(height));
    };
  }
  assert(encoding.empty() || raster::height_code(encoding));
  return picture_heights(raster::height_code(encoding));
}

}  // namespace tellurion::source
