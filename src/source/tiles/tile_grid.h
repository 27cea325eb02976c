// How the tiles of a pyramid cut the map.
// Thread-safe: values and pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"
#include "geo/ellipsoid.h"

namespace tellurion::source {

inline constexpr int kLargestTile = 4096;  ///< pixels on a side

/// One level of tiles.
struct TileLevel {
  glm::dvec2 corner;         ///< upper left corner of tile (0, 0) in coordinates of the CRS
  glm::dvec2 pixel;          ///< CRS units per pixel along x and y, positive
  std::int64_t columns = 0;  ///< tiles
  std::int64_t rows = 0;
};

struct TileGrid {
  /// What PROJ understands. Its coordinates are (x to the east, y to the north), whatever order of axes the CRS declares.
  std::string crs;
  int tile_width = 256;           ///< pixels
  int tile_height = 256;
  std::vector<TileLevel> levels;  ///< by TileAddress::zoom: the coarsest first, each strictly finer than the one before
  int min_zoom = 0;               ///< the levels before it hold no tiles
};

/// EPSG:3857, one tile at level 0. Errors: invalid_argument (sizes and levels out of range).
Result<TileGrid> web_mercator_grid(int tile_size, int min_zoom, int max_zoom);

/// Longitude and latitude of `world`, two tiles side by side at level 0. Errors likewise.
Result<TileGrid> geographic_grid(int tile_size, int min_zoom, int max_zoom, const geo::Ellipsoid& world);

/// How pixels of one level lie in another: pixel of `to` = pixel of `from` * scale + offset.
struct LevelTransform {
  glm::dvec2 scale{1.0};
  glm::dvec2 offset{0.0};

  glm::dvec2 operator()(glm::dvec2 pixel) const { return pixel * scale + offset; }
};
LevelTransform transform_between(const TileLevel& from, const TileLevel& to);

}  // namespace tellurion::source
