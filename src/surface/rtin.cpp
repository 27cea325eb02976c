#include "surface/rtin.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdlib>

namespace tellurion::surface {
namespace {

std::size_t index_of(int x, int y, int side) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x);
}

struct GridPoint {
  int x = 0;
  int y = 0;
};

/// A right triangle: the hypotenuse from `a` to `b`, the right angle at `c`; counter-clockwise with rows downwards.
struct Triangle {
  GridPoint a, b, c;
};

GridPoint middle(GridPoint p, GridPoint q) { return {(p.x + q.x) / 2, (p.y + q.y) / 2}; }

/// Calls visit(midpoint, one end, other end, child_step, diagonal) for every hypotenuse, children before parents.
/// The midpoints of the children lie `child_step` away: along the axes below a diagonal hypotenuse, diagonally below an axial
/// one; child_step 0: the children are not split.
template <class Visit>
void for_each_hypotenuse(int side, Visit&& visit) {
  const int last = side - 1;
  for (int half = 1; half < last; half *= 2) {
    const int whole = 2 * half;
    for (int y = 0; y <= last; y += half) {
      const bool odd_row = ((y / half) & 1) != 0;
      for (int x = odd_row ? 0 : half; x <= last; x += whole) {
        if (odd_row) {
          visit(GridPoint{x, y}, GridPoint{x, y - half}, GridPoint{x, y + half}, half / 2, false);
        } else {
          visit(GridPoint{x, y}, GridPoint{x - half, y}, GridPoint{x + half, y}, half / 2, false);
        }
      }
    }
    for (int y = half; y <= last; y += whole) {
      for (int x = half; x <= last; x += whole) {
        const int down = runs_down_right(x / whole, y / whole) ? half : -half;
        visit(GridPoint{x, y}, GridPoint{x - half, y - down}, GridPoint{x + half, y + down}, half, true);
      }
    }
  }
}

/// Largest error at the midpoints of the children of the triangles on both sides of a hypotenuse.
float largest_below(std::span<const float> errors, int side, GridPoint m, int step, bool diagonal) {
  if (step == 0) return 0.0f;
  if (diagonal) {
    return std::max(std::max(errors[index_of(m.x - step, m.y, side)], errors[index_of(m.x + step, m.y, side)]),
                    std::max(errors[index_of(m.x, m.y - step, side)], errors[index_of(m.x, m.y + step, side)]));
  }
  float largest = 0.0f;
  for (const int dy : {-step, step}) {
    if (m.y + dy < 0 || m.y + dy >= side) continue;
    for (const int dx : {-step, step}) {
      if (m.x + dx < 0 || m.x + dx >= side) continue;
      largest = std::max(largest, errors[index_of(m.x + dx, m.y + dy, side)]);
    }
  }
  return largest;
}

/// Heights of a triangle's plane: value at (x, y) is origin + per_column * x + per_row * y.
struct Plane {
  double origin, per_column, per_row;
  double at(int x, int y) const { return origin + per_column * x + per_row * y; }
};

Plane plane_through(std::span<const double> heights, int side, const Triangle& t) {
  const double ha = heights[index_of(t.a.x, t.a.y, side)];
  const double hb = heights[index_of(t.b.x, t.b.y, side)];
  const double hc = heights[index_of(t.c.x, t.c.y, side)];
  const double ax = t.a.x - t.c.x, ay = t.a.y - t.c.y, bx = t.b.x - t.c.x, by = t.b.y - t.c.y;
  const double det = ax * by - bx * ay;
  const double gx = ((ha - hc) * by - (hb - hc) * ay) / det;
  const double gy = ((hb - hc) * ax - (ha - hc) * bx) / det;
  return {hc - gx * t.c.x - gy * t.c.y, gx, gy};
}

/// Calls visit(y, first x, last x) for the rows of grid points in a triangle, its border included.
template <class Visit>
void for_each_row(const Triangle& t, Visit&& visit) {
  std::array<GridPoint, 3> p{t.a, t.b, t.c};
  std::sort(p.begin(), p.end(), [](GridPoint l, GridPoint r) { return l.y < r.y; });
  // All edges run along axes or diagonals, so every crossing with a row is a grid point.
  const auto along = [](GridPoint from, GridPoint to, int y) {
    return to.y == from.y ? to.x : from.x + (to.x - from.x) * (y - from.y) / (to.y - from.y);
  };
  for (int y = p[0].y; y <= p[2].y; ++y) {
    const int one = along(p[0], p[2], y);
    const int other = y <= p[1].y ? along(p[0], p[1], y) : along(p[1], p[2], y);
    visit(y, std::min(one, other), std::max(one, other));
  }
}

double deviation_of(const Triangle& t, std::span<const double> heights, int side) {
  const Plane plane = plane_through(heights, side, t);
  double largest = 0.0;
  for_each_row(t, [&](int y, int first, int last) {
    const double start = plane.at(0, y);
    const double* row = heights.data() + index_of(0, y, side);
    for (int x = first; x <= last; ++x) {
      largest = std::max(largest, std::abs(row[x] - (start + plane.per_column * x)));
    }
  });
  return largest;
}

class Extractor {
 public:
  Extractor(std::span<const float> errors, int side, float tolerance)
      : errors_(errors), side_(side), tolerance_(tolerance), number_of_(errors.size(), kNone) {}

  GridTriangles run() {
    const int last = side_ - 1;
    add({{last, last}, {0, 0}, {0, last}});
    add({{0, 0}, {last, last}, {last, 0}});
    return std::move(out_);
  }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  void add(const Triangle& t) {
    const GridPoint m = middle(t.a, t.b);
    if (std::abs(t.a.x - t.c.x) + std::abs(t.a.y - t.c.y) > 1 && errors_[index_of(m.x, m.y, side_)] > tolerance_) {
      add({t.c, t.a, m});
      add({t.b, t.c, m});
    } else {
      const std::array<std::uint32_t, 3> corners{number_of(t.a), number_of(t.b), number_of(t.c)};
      out_.indices.insert(out_.indices.end(), corners.begin(), corners.end());
    }
  }

  std::uint32_t number_of(GridPoint p) {
    const std::size_t i = index_of(p.x, p.y, side_);
    if (number_of_[i] == kNone) {
      number_of_[i] = static_cast<std::uint32_t>(out_.points.size());
      out_.points.push_back(static_cast<std::uint32_t>(i));
    }
    return number_of_[i];
  }

  std::span<const float> errors_;
  int side_;
  float tolerance_;
  std::vector<std::uint32_t> number_of_;
  GridTriangles out_;
};

}  // namespace

std::vector<float> midpoint_errors(std::span<const float> heights, int side) {
  assert(is_rtin_side(side) && heights.size() == static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  std::vector<float> errors(heights.size(), 0.0f);
  for_each_hypotenuse(side, [&](GridPoint m, GridPoint a, GridPoint b, int step, bool diagonal) {
    const std::size_t i = index_of(m.x, m.y, side);
    const double mean =
        (static_cast<double>(heights[index_of(a.x, a.y, side)]) + static_cast<double>(heights[index_of(b.x, b.y, side)])) / 2.0;
    const auto own = static_cast<float>(std::abs(mean - static_cast<double>(heights[i])));
    errors[i] = std::max(own, largest_below(errors, side, m, step, diagonal));
  });
  return errors;
}

std::vector<float> true_errors(std::span<const double> heights, int side) {
  assert(is_rtin_side(side) && heights.size() == static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  std::vector<float> errors(heights.size(), 0.0f);
  for_each_hypotenuse(side, [&](GridPoint m, GridPoint a, GridPoint b, int step, bool diagonal) {
    const float below = largest_below(errors, side, m, step, diagonal);
    float& error = errors[index_of(m.x, m.y, side)];
    error = below;
    // The right angles of the triangles on both sides of the hypotenuse: (b - a) / 2 turned by a right angle.
    const int rx = -(b.y - a.y) / 2, ry = (b.x - a.x) / 2;
    double largest = 0.0;
    for (const int sign : {-1, 1}) {
      const GridPoint c{m.x + sign * rx, m.y + sign * ry};
      if (c.x < 0 || c.x >= side || c.y < 0 || c.y >= side) continue;
      largest = std::max(largest, deviation_of({a, b, c}, heights, side));
    }
    // Rounded up, so that a comparison with the tolerance stays on the safe side.
    if (largest > 0.0) error = std::max(below, std::nextafter(static_cast<float>(largest), HUGE_VALF));
  });
  return errors;
}

void saturate_errors(std::span<float> errors, int side) {
  for_each_hypotenuse(side, [&](GridPoint m, GridPoint, GridPoint, int step, bool diagonal) {
    float& own = errors[index_of(m.x, m.y, side)];
    own = std::max(own, largest_below(errors, side, m, step, diagonal));
  });
}

GridTriangles extract_triangles(std::span<const float> errors, int side, float tolerance) {
  assert(is_rtin_side(side) && errors.size() == static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  return Extractor(errors, side, tolerance).run();
}

std::vector<double> drawn_heights(const GridTriangles& triangles, std::span<const double> heights, int side) {
  const auto point = [&](std::size_t corner) {
    const int p = static_cast<int>(triangles.points[triangles.indices[corner]]);
    return GridPoint{p % side, p / side};
  };
  std::vector<double> drawn(heights.size());
  for (std::size_t i = 0; i < triangles.indices.size(); i += 3) {
    const Triangle t{point(i), point(i + 1), point(i + 2)};
    const Plane plane = plane_through(heights, side, t);
    for_each_row(t, [&](int y, int first, int last) {
      for (int x = first; x <= last; ++x) drawn[index_of(x, y, side)] = plane.at(x, y);
    });
  }
  // Corners exactly, not by their plane.
  for (const std::uint32_t p : triangles.points) drawn[p] = heights[p];
  return drawn;
}

double largest_deviation(const GridTriangles& triangles, std::span<const double> heights, int side) {
  const auto point = [&](std::size_t corner) {
    const int p = static_cast<int>(triangles.points[triangles.indices[corner]]);
    return GridPoint{p % side, p / side};
  };
  double largest = 0.0;
  for (std::size_t i = 0; i < triangles.indices.size(); i += 3) {
    largest = std::max(largest, deviation_of({point(i), point(i + 1), point(i + 2)}, heights, side));
  }
  return largest;
}

}  // namespace tellurion::surface
