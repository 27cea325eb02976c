#include "surface/tile_builder.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "surface/rtin.h"
#include "surface/slope_map.h"
#include "surface/tile_grid.h"
#include "surface/tile_mesh.h"

namespace tellurion::surface {
namespace {

constexpr int kCells = kGridSide - 1;
constexpr int kFineSide = 2 * kGridSide + 1;  ///< half steps over the tile, and one more beyond each border

/// The height samples that a tile's grid is made of are as far apart as the grid itself while its error is known from the
/// finest data; below that they are the finest there are.
double wanted_spacing(const SurfaceFacts& facts, const geo::Ellipsoid& ellipsoid, const geo::TileKey& key) {
  return facts.facts_of(key).height_error ? nominal_grid_spacing(ellipsoid, key.level) : 0.0;
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double width() const { return high - low; }
};

/// What the parent level's full grid shows at the grid points of its child `key`.
Result<std::vector<double>> parent_heights(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key) {
  constexpr int kHalf = kCells / 2 + 1;
  const std::vector<geo::Vector<geo::Ecef>> normals = grid_normals(key, kHalf);
  std::vector<double> coarse(normals.size());
  const double spacing = wanted_spacing(facts, model.description().ellipsoid, geo::parent(key));
  if (Result<void> read = model.heights(normals, spacing, coarse); !read) return read.error();
  // A child begins at an even column and row of its parent's grid, so both split their cells alike.
  std::vector<double> heights;
  heights.reserve(static_cast<std::size_t>(kGridSide) * static_cast<std::size_t>(kGridSide));
  for (int row = 0; row < kGridSide; ++row) {
    for (int column = 0; column < kGridSide; ++column) {
      heights.push_back(interpolate_in_triangles(coarse, kHalf, column / 2.0, row / 2.0));
    }
  }
  return heights;
}

/// A tile's grid and how well it shows the surface.
struct HeightField {
  std::vector<geo::Vector<geo::Ecef>> normals;
  std::vector<double> heights;
  double error = 0.0;
};

Result<HeightField> known_field(ElevationModel& model, const geo::TileKey& key, double error) {
  HeightField field;
  field.normals = grid_normals(key, kGridSide);
  field.heights.resize(field.normals.size());
  field.error = error;
  const double spacing = nominal_grid_spacing(model.description().ellipsoid, key.level);
  if (Result<void> read = model.heights(field.normals, spacing, field.heights); !read) return read.error();
  return field;
}

Result<HeightField> measured_field(ElevationModel& model, const geo::TileKey& key) {
  constexpr double kStep = 0.5 / kCells;
  const std::vector<geo::Vector<geo::Ecef>> normals = grid_normals(key, kFineSide, -kStep, 1.0 + kStep);
  std::vector<double> heights(normals.size());
  if (Result<void> read = model.heights(normals, 0.0, heights); !read) return read.error();
  HeightField field;
  field.error = error_between_samples(heights);
  // The grid's own places again, not those of the finer one: neighbours share them to the bit.
  field.normals = grid_normals(key, kGridSide);
  field.heights.reserve(field.normals.size());
  for (int row = 0; row < kGridSide; ++row) {
    for (int column = 0; column < kGridSide; ++column) {
      field.heights.push_back(heights[static_cast<std::size_t>((2 * row + 1) * kFineSide + 2 * column + 1)]);
    }
  }
  return field;
}

/// The error of the nearest ancestor for which it is known: nothing below can be worse.
double error_of_ancestors(const SurfaceFacts& facts, geo::TileKey key) {
  while (key.level > 0) {
    key = geo::parent(key);
    if (const std::optional<float> error = facts.facts_of(key).height_error) return static_cast<double>(*error);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

// Let f be the surface, g = f - (its interpolation over a triangle T of the grid), in units of the grid's step, so that T's
// corners are v0 = (0, 0), v1 = (1, 0), v2 = (0, 1) after a rotation. g vanishes at the corners. Let f be piecewise smooth and
// continuous, with df/dx and df/dy over T within ranges of widths wx and wy; those of g have the same widths. Let m be the
// middle of its ranges. For p = (x, y) = sum l_i v_i in T (l_i >= 0, sum l_i = 1) and every i,
//   g(p) = integral of grad g from v_i to p = m . (p - v_i) + r_i,  |r_i| <= wx/2 |x - x_i| + wy/2 |y - y_i|.
// Weighted by l_i and summed, the terms in m cancel: |g(p)| <= sum l_i |r_i| = wx x (1 - x) + wy y (1 - y) <= (wx + wy) / 4.
// It is attained by a crease along the triangle's middle. The ranges are taken from differences over half steps up to one half step
// beyond the cell: with samples at least a grid step apart, every piece of f that reaches into the cell holds such a step.
double error_between_samples(std::span<const double> heights) {
  assert(heights.size() == static_cast<std::size_t>(kFineSide) * static_cast<std::size_t>(kFineSide));
  const auto at = [&](int x, int y) { return heights[static_cast<std::size_t>(y * kFineSide + x)]; };
  double largest = 0.0;
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      Range per_column, per_row;
      for (int y = 2 * row; y <= 2 * row + 4; ++y) {
        for (int x = 2 * column; x < 2 * column + 4; ++x) per_column.add(at(x + 1, y) - at(x, y));
      }
      for (int y = 2 * row; y < 2 * row + 4; ++y) {
        for (int x = 2 * column; x <= 2 * column + 4; ++x) per_row.add(at(x, y + 1) - at(x, y));
      }
      largest = std::max(largest, per_column.width() + per_row.width());
    }
  }
  return largest / 2.0;  // a quarter, of differences per half step
}

Result<TileGeometry> build_geometry(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key,
                                    const MeshSettings& settings, std::stop_token stop) {
  const TileFacts known = facts.facts_of(key);
  Result<HeightField> field =
      known.height_error ? known_field(model, key, static_cast<double>(*known.height_error)) : measured_field(model, key);
  if (!field) return field.error();
  if (!known.height_error) field->error = std::min(field->error, error_of_ancestors(facts, key));
  if (stop.stop_requested()) return Error{ErrorCode::cancelled, "geometry of " + geo::to_string(key)};

  std::vector<double> parents = field->heights;
  if (key.level > 0) {
    Result<std::vector<double>> coarse = parent_heights(model, facts, key);
    if (!coarse) return coarse.error();
    parents = std::move(coarse).value();
  }

  const geo::Ellipsoid& ellipsoid = model.description().ellipsoid;
  const double least = settings.of_tile_size * nominal_tile_size(ellipsoid, key.level);
  const MeshTolerance tolerance{std::max(settings.of_grid_error * field->error, least), least};
  DecimatedMesh decimated = make_tile_mesh(ellipsoid, key, field->normals, field->heights, parents, tolerance);

  TileGeometry geometry;
  geometry.mesh = std::move(decimated.mesh);
  geometry.metrics.height_error = static_cast<float>(field->error + decimated.height_deviation);
  geometry.metrics.curvature_error = static_cast<float>(decimated.curvature_deviation);
  const auto [lowest, highest] = std::minmax_element(field->heights.begin(), field->heights.end());
  // The drawn heights, and the true ones: as the facts have them or within the error of those drawn.
  geometry.metrics.min_height = static_cast<float>(std::min(*lowest, std::max(*lowest - field->error, double{known.min_height})));
  geometry.metrics.max_height = static_cast<float>(std::max(*highest, std::min(*highest + field->error, double{known.max_height})));
  if (known.own_slopes) {
    Result<SlopeMap> slopes = build_slopes(model, key, stop);
    if (!slopes) return slopes.error();
    geometry.slopes = std::move(slopes).value();
  }
  return geometry;
}

}  // namespace tellurion::surface
