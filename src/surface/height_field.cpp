#include "surface/height_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>

#include "surface/rtin.h"
#include "surface/tile_content.h"
#include "surface/tile_grid.h"
#include "surface/tile_samples.h"

namespace tellurion::surface {
namespace {

constexpr int kCells = kGridSide - 1;
constexpr int kFineSide = 2 * kGridSide + 1;  ///< half steps over the tile, and one more beyond each border

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double width() const { return high - low; }
};

}  // namespace

Result<HeightField> field_of_known_error(ElevationModel& model, const geo::TileKey& key, double error) {
  HeightField field;
  field.normals = grid_normals(key, kGridSide);
  field.heights.resize(field.normals.size());
  field.error = error;
  const double spacing = nominal_grid_spacing(model.description().ellipsoid, key.level);
  if (Result<void> read = model.heights(field.normals, spacing, field.heights); !read) return read.error();
  return field;
}

Result<HeightField> field_of_finest_data(ElevationModel& model, const geo::TileKey& key) {
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
  constexpr int kHalfSteps = 2 * kGridSide - 1;
  field.fine.reserve(static_cast<std::size_t>(kHalfSteps) * kHalfSteps);
  for (int row = 1; row <= kHalfSteps; ++row) {
    const double* first = heights.data() + row * kFineSide + 1;
    field.fine.insert(field.fine.end(), first, first + kHalfSteps);
  }
  return field;
}

Result<double> measured_error(ElevationModel& model, const geo::TileKey& key, std::span<const double> drawn,
                              std::span<const double> fine) {
  constexpr int kHalfSteps = 2 * kGridSide - 1;
  constexpr double kBetweenPlaces = 1.1;
  assert(drawn.size() == static_cast<std::size_t>(kGridSide) * kGridSide && fine.size() == static_cast<std::size_t>(kHalfSteps) * kHalfSteps);
  double largest = 0.0;
  for (int y = 0; y < kHalfSteps; ++y) {
    for (int x = 0; x < kHalfSteps; ++x) {
      const double shown = interpolate_in_triangles(drawn, kGridSide, x / 2.0, y / 2.0);
      largest = std::max(largest, std::abs(fine[static_cast<std::size_t>(y * kHalfSteps + x)] - shown));
    }
  }
  for (std::size_t i = 0; i < model.layer_count(); ++i) {
    if (!model.layer(i).source->coverage().touches(key)) continue;
    const std::vector<TileSample> samples = samples_under(model.raster(i).reader(), model.raster(i).description(), key);
    std::vector<geo::LatLon> places(samples.size());
    std::transform(samples.begin(), samples.end(), places.begin(), [](const TileSample& s) { return s.place; });
    std::vector<double> metres(samples.size());
    if (Result<void> read = model.heights(places, 0.0, metres); !read) return read.error();
    for (std::size_t n = 0; n < samples.size(); ++n) {
      const glm::dvec2 grid = samples[n].st * static_cast<double>(kCells);
      largest = std::max(largest, std::abs(metres[n] - interpolate_in_triangles(drawn, kGridSide, grid.x, grid.y)));
    }
  }
  return kBetweenPlaces * largest;
}

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

}  // namespace tellurion::surface
