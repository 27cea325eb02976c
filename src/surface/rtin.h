// Right-triangulated irregular networks: a square grid of heights as few triangles as a tolerance allows.
// Thread-safe: pure functions.
//
// The grid has 2^k + 1 points a side. Two right triangles, split by the diagonal from (0, 0), fill it; every triangle is
// halved at its hypotenuse's midpoint as long as the error kept there exceeds the tolerance. Errors grow towards the root,
// so neighbours always agree on their common edge and no T-junctions arise.
// After Evans, Kirkpatrick, Townsend (2001), doi:10.1007/s00453-001-0006-x.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tellurion::surface {

/// Triangles over the points (index % side, index / side) of a grid; seen with columns to the right and rows downwards they
/// run counter-clockwise.
struct GridTriangles {
  std::vector<std::uint32_t> points;   ///< grid index of every vertex, each once
  std::vector<std::uint32_t> indices;  ///< three a triangle, into `points`
};

/// Whether `side` is 2^k + 1 with k >= 1.
constexpr bool is_rtin_side(int side) { return side >= 3 && ((side - 1) & (side - 2)) == 0; }

/// How a cell is halved at full resolution, where all diagonals end at points of odd column and row: from its first corner to
/// its last, else from the second to the third.
constexpr bool runs_down_right(int column, int row) { return ((column ^ row) & 1) == 0; }

/// Height at (x, y) in grid units of the full-resolution triangulation; x, y within [0, side - 1].
inline double interpolate_in_triangles(std::span<const double> heights, int side, double x, double y) {
  const int column = std::clamp(static_cast<int>(x), 0, side - 2);
  const int row = std::clamp(static_cast<int>(y), 0, side - 2);
  const double fx = x - column, fy = y - row;
  const double* cell = heights.data() + static_cast<std::size_t>(row * side + column);
  const double h00 = cell[0], h10 = cell[1], h01 = cell[side], h11 = cell[side + 1];
  const bool down_right = runs_down_right(column, row);
  const bool at_top = down_right ? fx >= fy : fx + fy <= 1.0;  // in the triangle that has the cell's upper edge
  const double per_x = at_top ? h10 - h00 : h11 - h01;
  const double per_y = down_right == at_top ? h11 - h10 : h01 - h00;
  const double start = down_right || at_top ? h00 : h01 + h10 - h11;
  return start + fx * per_x + fy * per_y;
}

/// Errors by the criterion of @mapbox/martini: at every point the distance between its height and the mean of its
/// hypotenuse's ends, or the largest below it. Not a bound: the true deviation of a mesh can be 1.4 to 1.8 times larger.
std::vector<float> midpoint_errors(std::span<const float> heights, int side);

/// True errors: at every point the largest deviation of all grid points from the plane of either triangle that it would
/// split, or the largest below it. A mesh extracted at a tolerance stays within it at every grid point.
std::vector<float> true_errors(std::span<const double> heights, int side);

/// The coarsest conforming triangulation that splits wherever `errors` exceed `tolerance`. `errors` must grow towards the
/// root as those above do.
GridTriangles extract_triangles(std::span<const float> errors, int side, float tolerance);

/// Raises errors so that they grow towards the root; needed after changing single ones.
void saturate_errors(std::span<float> errors, int side);

/// The heights that triangles with corners at `heights` show at every grid point.
std::vector<double> drawn_heights(const GridTriangles& triangles, std::span<const double> heights, int side);

/// Largest distance between `heights` and the triangles at all grid points.
double largest_deviation(const GridTriangles& triangles, std::span<const double> heights, int side);

}  // namespace tellurion::surface
