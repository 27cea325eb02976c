#include "source/tiles/service_grids.h"
#include "source/proj/projection.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

namespace tellurion::source {
namespace {

constexpr double kStandardPixel = 0.00028;  ///< metres: OGC's "standardized rendering pixel size"
/// Of every service, whatever its ellipsoid: OGC 07-057r7, annex E, counts with it.
constexpr double kMetresPerDegree = geo::kWgs84.a() * std::numbers::pi / 180.0;
constexpr double kMercatorHalf = std::numbers::pi * geo::kWgs84.a();
constexpr double kMostPixels = 1 << 30;  ///< of a level, on a side
constexpr int kMostLevels = 31;
constexpr double kFarthest = 1e12;       ///< of a corner, in units of the CRS
constexpr double kFinest = 1e-12;        ///< pixel

/// How far it is round the body along x, for grids that may go round it; 0 for others.
double way_round(const std::string& crs, const CrsAxes& axes) {
  if (axes.is_geographic) return 360.0;
  return crs == "EPSG:3857" ? 2.0 * kMercatorHalf : 0.0;
}

/// Scales are written with few digits: a level that all but goes round the body does so.
void snap_to_world(TileLevel& level, double way, int tile_width) {
  constexpr double kRounding = 1e-6;
  const double across = static_cast<double>(level.columns) * tile_width * level.pixel.x;
  if (way <= 0.0 || std::abs(across / way - 1.0) > kRounding || std::abs(level.corner.x + 0.5 * way) > kRounding * way) return;
  level.pixel = glm::dvec2(way / (static_cast<double>(level.columns) * tile_width));
  level.corner.x = -0.5 * way;
}

bool fits(const TileLevel& level, int tile_width, int tile_height) {
  return std::isfinite(level.pixel.x) && level.pixel.x >= kFinest && std::abs(level.corner.x) <= kFarthest && std::abs(level.corner.y) <= kFarthest &&
         level.columns >= 1 && level.rows >= 1 && static_cast<double>(level.columns) * tile_width <= kMostPixels && static_cast<double>(level.rows) * tile_height <= kMostPixels;
}

double pixel_of(const TileMatrix& matrix, const CrsAxes& axes) {
  return matrix.scale_denominator * kStandardPixel / (axes.is_geographic ? kMetresPerDegree : axes.metres_per_unit);
}

bool contains(const TileMatrix& matrix, glm::dvec2 corner, double pixel, glm::dvec2 at) {
  const double width = static_cast<double>(matrix.columns) * matrix.tile_width * pixel, height = static_cast<double>(matrix.rows) * matrix.tile_height * pixel;
  return at.x >= corner.x && at.x <= corner.x + width && at.y <= corner.y && at.y >= corner.y - height;
}

/// The upper left corner with x to the right.
glm::dvec2 corner_of(const TileMatrix& matrix, const CrsAxes& axes, std::optional<glm::dvec2> inside) {
  const glm::dvec2 written = matrix.corner, turned(written.y, written.x);
  const glm::dvec2 corner = axes.north_first ? turned : written, other = axes.north_first ? written : turned;
  if (!axes.north_first && !axes.is_geographic) return corner;
  if (axes.is_geographic && corner.y <= -90.0) return other;  // no map begins at or below the south pole
  const double pixel = pixel_of(matrix, axes);
  return inside && !contains(matrix, corner, pixel, *inside) && contains(matrix, other, pixel, *inside) ? other : corner;
}

std::pair<int, int> commonest_size(const std::vector<TileMatrix>& matrices) {
  std::map<std::pair<int, int>, int> count;
  for (const TileMatrix& matrix : matrices) ++count[{matrix.tile_width, matrix.tile_height}];
  return std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; })->first;
}

using LimitsByMatrix = std::unordered_map<std::string_view, const TileMatrixLimits*>;

/// The tiles that the limits allow; none if they leave the matrix out.
std::optional<TileRange> range_of(const TileMatrix& matrix, const LimitsByMatrix& limits) {
  const TileRange all{0, matrix.columns - 1, 0, matrix.rows - 1};
  if (limits.empty()) return all;
  const auto found = limits.find(matrix.identifier);
  if (found == limits.end()) return std::nullopt;
  const TileMatrixLimits& limit = *found->second;
  const TileRange range{limit.least_column, std::min(limit.most_column, all.most_column), limit.least_row, std::min(limit.most_row, all.most_row)};
  if (range.least_column > range.most_column || range.least_row > range.most_row) return std::nullopt;
  return range;
}

}  // namespace

std::string grid_crs(const std::string& crs, const CrsAxes& axes, const geo::Ellipsoid& world) {
  const bool of_earth = std::abs(axes.radius / geo::kWgs84.a() - 1.0) <= 0.01;
  if (axes.is_geographic && of_earth && !is_earth(world)) return fmt::format("+proj=longlat +a={:.3f} +b={:.3f} +no_defs", world.a(), world.b());
  return crs;
}

Result<MatrixGrid> matrix_grid(const TileMatrixSet& set, const std::vector<TileMatrixLimits>& limits, const CrsAxes& axes, const std::string& crs,
                               std::optional<glm::dvec2> inside) {
  std::vector<TileMatrix> matrices = set.matrices;
  std::stable_sort(matrices.begin(), matrices.end(), [](const auto& a, const auto& b) { return a.scale_denominator > b.scale_denominator; });
  MatrixGrid made;
  made.grid.crs = crs;
  LimitsByMatrix by_matrix;
  for (const TileMatrixLimits& limit : limits) by_matrix.emplace(limit.matrix, &limit);
  if (!matrices.empty()) std::tie(made.grid.tile_width, made.grid.tile_height) = commonest_size(matrices);
  for (const TileMatrix& matrix : matrices) {
    if (made.grid.levels.size() == kMostLevels) break;
    TileLevel level;
    level.corner = corner_of(matrix, axes, inside);
    level.pixel = glm::dvec2(pixel_of(matrix, axes));
    level.columns = matrix.columns;
    level.rows = matrix.rows;
    snap_to_world(level, way_round(crs, axes), matrix.tile_width);
    const std::optional<TileRange> range = range_of(matrix, by_matrix);
    const bool same_size = matrix.tile_width == made.grid.tile_width && matrix.tile_height == made.grid.tile_height;
    const bool finer = made.grid.levels.empty() || level.pixel.x < 0.999 * made.grid.levels.back().pixel.x;
    if (!range || !same_size || !finer || !fits(level, matrix.tile_width, matrix.tile_height)) continue;
    made.grid.levels.push_back(level);
    made.matrices.push_back(matrix.identifier);
    made.ranges.push_back(*range);
  }
  if (made.grid.levels.empty()) return Error{ErrorCode::unsupported, fmt::format("its tile matrix set {} has no level that can be shown", set.identifier)};
  return made;
}

Result<TileGrid> box_grid(const std::string& crs, const std::array<double, 4>& box, int tile_size, double finest_pixel) {
  const double width = box[2] - box[0], height = box[3] - box[1];
  if (!(width > 0.0 && height > 0.0 && width < 1e12 && height < 1e12))
    return Error{ErrorCode::invalid_argument, fmt::format("its extent in {} is empty or too large: {} {} {} {}", crs, box[0], box[1], box[2], box[3])};
  TileGrid grid;
  grid.crs = crs;
  grid.tile_width = grid.tile_height = tile_size;
  double pixel = std::max(width, height) / tile_size;
  for (std::int64_t across = 1; static_cast<int>(grid.levels.size()) < kMostLevels && static_cast<double>(across) * tile_size <= kMostPixels; across *= 2) {
    const auto count = [&](double length) { return std::max<std::int64_t>(static_cast<std::int64_t>(std::ceil(length / (pixel * tile_size) - 1e-9)), 1); };
    grid.levels.push_back({{box[0], box[3]}, glm::dvec2(pixel), count(width), count(height)});
    if (pixel <= finest_pixel) break;
    pixel *= 0.5;
  }
  return grid;
}

namespace {

/// Where a map lies: its lower left corner, from which tiles count, and what it reaches.
struct TmsExtent {
  glm::dvec2 origin{};
  std::array<double, 4> box{};
  std::optional<std::array<double, 4>> degrees;  ///< what the box was before it was found to be no box of the CRS
};

bool are_degrees(const std::array<double, 4>& box) {
  return std::all_of(box.begin(), box.end(), [](double edge) { return std::abs(edge) <= 180.5; });
}

/// gdal2tiles 1 wrote latitudes as x; its origin was right.
std::array<double, 4> upright(const TmsResource& map) {
  const auto& b = map.box;
  const bool turned = b[1] < -90.5 || b[3] > 90.5 || (b[0] != b[1] && map.origin.x == b[1] && map.origin.y == b[0]);
  return turned ? std::array{b[1], b[0], b[3], b[2]} : b;
}

TmsExtent extent_of(const TmsResource& map, bool mercator, bool geographic) {
  TmsExtent extent{map.origin, map.box, std::nullopt};
  if (!map.profile.ends_with("mercator") && !map.profile.ends_with("geodetic")) return extent;
  if (mercator) {
    extent.origin = {-kMercatorHalf, -kMercatorHalf};
    if (are_degrees(map.box)) {  // the other reading: a few hundred metres round 0 N 0 E
      extent.box = {-kMercatorHalf, -kMercatorHalf, kMercatorHalf, kMercatorHalf};
      extent.degrees = upright(map);
    }
  } else if (geographic) {
    extent.origin = {-180.0, -90.0};
    extent.box = upright(map);
  }
  return extent;
}

}  // namespace

Result<TmsGrid> tms_grid(const TmsResource& map, const CrsAxes& axes, const std::string& crs) {
  const bool mercator = crs == "EPSG:3857";
  const TmsExtent extent = extent_of(map, mercator, axes.is_geographic);
  TmsGrid made;
  made.bounds = extent.degrees;
  made.grid.crs = crs;
  made.grid.tile_width = map.tile_width;
  made.grid.tile_height = map.tile_height;
  const double round_the_body = way_round(crs, axes);
  const double way = std::abs(extent.origin.x + 0.5 * round_the_body) <= 1e-6 * round_the_body ? round_the_body : 0.0;
  for (const TmsResource::Level& level : map.levels) {
    const glm::dvec2 tile = glm::dvec2(map.tile_width, map.tile_height) * level.units_per_pixel;
    // In tiles from the origin; a millionth of one is rounding.
    const double left = std::floor((extent.box[0] - extent.origin.x) / tile.x + 1e-6), right = std::ceil((extent.box[2] - extent.origin.x) / tile.x - 1e-6);
    const double bottom = std::floor((extent.box[1] - extent.origin.y) / tile.y + 1e-6), top = std::ceil((extent.box[3] - extent.origin.y) / tile.y - 1e-6);
    const double most = kMostPixels / std::max(map.tile_width, map.tile_height);
    // Columns count from the map's origin; where that is the antimeridian they go all round.
    const double columns = way > 0.0 ? std::max(std::round(way / tile.x), right) : right;
    if (!(left >= 0.0 && bottom >= 0.0 && right > left && top > bottom && columns >= right && columns <= most && top <= most)) continue;
    TileLevel made_level{{extent.origin.x, extent.origin.y + top * tile.y}, glm::dvec2(level.units_per_pixel), static_cast<std::int64_t>(columns), static_cast<std::int64_t>(top)};
    snap_to_world(made_level, way, map.tile_width);
    made_level.corner.y = extent.origin.y + top * made_level.pixel.y * map.tile_height;
    const bool finer = made.grid.levels.empty() || made_level.pixel.x < 0.999 * made.grid.levels.back().pixel.x;
    if (!finer || !fits(made_level, map.tile_width, map.tile_height) || made.grid.levels.size() == kMostLevels) continue;
    made.grid.levels.push_back(made_level);
    made.hrefs.push_back(level.href);
    made.south_rows.push_back(static_cast<std::int64_t>(top) - 1);
    made.ranges.push_back({static_cast<std::int64_t>(left), static_cast<std::int64_t>(right) - 1, 0, static_cast<std::int64_t>(top - bottom) - 1});
  }
  if (made.grid.levels.empty()) return Error{ErrorCode::unsupported, "its tile sets, origin and extent do not fit together: no level can be shown"};
  return made;
}

}  // namespace tellurion::source
