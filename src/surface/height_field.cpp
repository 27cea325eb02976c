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
constexpr int kHalfSteps = 2 * kGridSide - 1;
constexpr int kFineSide = kHalfSteps + 2;  ///< half steps over the tile, and one more beyond each border

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double width() const { return high - low; }
};

/// The samples of all layers within the tile.
Result<void> add_samples(ElevationModel& model, const geo::TileKey& key, FinestHeights& finest) {
  std::vector<geo::LatLon> places;
  const Result<void> visited = model.for_each_under(key, [&](cache::CachedRaster& raster, Metres) -> Result<void> {
    for (const TileSample& sample : samples_under(raster.reader(), raster.description(), key)) {
      places.push_back(sample.place);
      finest.places.push_back(sample.st * static_cast<double>(kCells));
    }
    return {};
  });
  if (!visited) return visited;
  finest.samples.resize(places.size());
  return model.heights(places, 0.0, finest.samples);
}

}  // namespace

Result<HeightField> field_of_known_error(ElevationModel& model, const geo::TileKey& key, const HeightError& error) {
  HeightField field;
  field.normals = grid_normals({key, kGridSide});
  field.heights.resize(field.normals.size());
  field.error = error;
  field.judged_error = static_cast<double>(judged(error));
  const double spacing = nominal_grid_spacing(model.description().ellipsoid, key.level);
  if (Result<void> read = model.heights(TileLattice{key, kGridSide}, spacing, field.heights); !read) return read.error();
  return field;
}

Result<HeightField> field_of_finest_data(ElevationModel& model, const geo::TileKey& key) {
  constexpr double kStep = 0.5 / kCells;
  std::vector<double> heights(static_cast<std::size_t>(kFineSide) * kFineSide);
  if (Result<void> read = model.heights(TileLattice{key, kFineSide, -kStep, 1.0 + kStep}, 0.0, heights); !read) return read.error();
  HeightField field;
  field.normals = grid_normals({key, kGridSide});
  field.heights.reserve(field.normals.size());
  for (int row = 0; row < kGridSide; ++row) {
    for (int column = 0; column < kGridSide; ++column) {
      field.heights.push_back(heights[static_cast<std::size_t>((2 * row + 1) * kFineSide + 2 * column + 1)]);
    }
  }
  field.finest.half_steps.reserve(static_cast<std::size_t>(kHalfSteps) * kHalfSteps);
  for (int row = 1; row <= kHalfSteps; ++row) {
    const double* first = heights.data() + row * kFineSide + 1;
    field.finest.half_steps.insert(field.finest.half_steps.end(), first, first + kHalfSteps);
  }
  if (Result<void> read = add_samples(model, key, field.finest); !read) return read.error();
  const HeightError found = field.finest.deviation_of(field.heights);
  field.error = {static_cast<float>(error_between_samples(heights)), found.common};
  field.judged_error = static_cast<double>(judged(found));
  return field;
}

HeightError FinestHeights::deviation_of(std::span<const double> drawn) const {
  constexpr double kBetweenPlaces = 1.1;
  assert(drawn.size() == static_cast<std::size_t>(kGridSide) * kGridSide);
  assert(half_steps.size() == static_cast<std::size_t>(kHalfSteps) * kHalfSteps);
  DeviationTally tally;
  const auto compare = [&](int x, int y, double shown) {
    tally.add(std::abs(half_steps[static_cast<std::size_t>(y * kHalfSteps + x)] - shown));
  };
  // Half-way between its points the full triangulation shows their mean, in the middle of a cell along its diagonal.
  for (int row = 0; row < kGridSide; ++row) {
    for (int column = 0; column < kGridSide; ++column) {
      const double* at = drawn.data() + row * kGridSide + column;
      const int x = 2 * column, y = 2 * row;
      compare(x, y, at[0]);
      if (column < kCells) compare(x + 1, y, (at[0] + at[1]) / 2.0);
      if (row < kCells) compare(x, y + 1, (at[0] + at[kGridSide]) / 2.0);
      if (column < kCells && row < kCells) {
        const double ends = runs_down_right(column, row) ? at[0] + at[kGridSide + 1] : at[1] + at[kGridSide];
        compare(x + 1, y + 1, ends / 2.0);
      }
    }
  }
  const auto common = static_cast<float>(tally.common());
  double largest = tally.largest();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    largest = std::max(largest, std::abs(samples[i] - interpolate_in_triangles(drawn, kGridSide, places[i].x, places[i].y)));
  }
  return {static_cast<float>(kBetweenPlaces * largest), common};
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
