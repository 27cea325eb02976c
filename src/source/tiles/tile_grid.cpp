#include "source/tiles/tile_grid.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "source/proj/projection.h"

namespace tellurion::source {
namespace {

constexpr std::int64_t kMostPixels = 1 << 30;  ///< of the finest level, on a side

/// Levels that halve the pixel, from `columns` x 1 tiles over a map `width` wide and `height` high.
Result<TileGrid> halving_grid(std::string crs, int columns, glm::dvec2 corner, double width, int tile_size, int min_zoom, int max_zoom) {
  const auto invalid = [](const std::string& what) { return Error{ErrorCode::invalid_argument, what}; };
  if (tile_size < 16 || tile_size > kLargestTile) return invalid(fmt::format("tile_size = {}: it is from 16 to {}", tile_size, kLargestTile));
  if (min_zoom < 0 || max_zoom < min_zoom)
    return invalid(fmt::format("min_level = {} and max_level = {}: 0 <= min_level <= max_level", min_zoom, max_zoom));
  const std::int64_t across = std::int64_t{columns} * tile_size;
  if (max_zoom > 30 || (across << max_zoom) > kMostPixels) return invalid(fmt::format("max_level = {} is deeper than can be shown", max_zoom));
  TileGrid grid{std::move(crs), tile_size, tile_size, {}, min_zoom};
  for (int zoom = 0; zoom <= max_zoom; ++zoom)
    grid.levels.push_back({corner, glm::dvec2(width / static_cast<double>(across << zoom)), std::int64_t{columns} << zoom, std::int64_t{1} << zoom});
  return grid;
}

}  // namespace


Result<TileGrid> web_mercator_grid(int tile_size, int min_zoom, int max_zoom) {
  const double half = std::numbers::pi * geo::kWgs84.a();
  return halving_grid("EPSG:3857", 1, {-half, half}, 2.0 * half, tile_size, min_zoom, max_zoom);
}

Result<TileGrid> geographic_grid(int tile_size, int min_zoom, int max_zoom, const geo::Ellipsoid& world) {
  return halving_grid(geographic_crs(world), 2, {-180.0, 90.0}, 360.0, tile_size, min_zoom, max_zoom);
}

LevelTransform transform_between(const TileLevel& from, const TileLevel& to) {
  const glm::dvec2 down(1.0, -1.0);  // rows go down, y goes up
  return {from.pixel / to.pixel, (from.corner - to.corner) * down / to.pixel};
}

}  // namespace tellurion::source
