#include "surface/rtin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

using namespace tellurion::surface;

namespace {

/// The algorithm of @mapbox/martini 0.2.0, written out as its index.js is: coordinates of all triangles, then bottom-up.
std::vector<float> martini_errors(const std::vector<float>& terrain, int size) {
  const int tile = size - 1;
  const int triangles = tile * tile * 2 - 2;
  const int parents = triangles - tile * tile;
  std::vector<float> errors(terrain.size(), 0.0f);
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y * size + x); };
  for (int i = triangles - 1; i >= 0; --i) {
    int id = i + 2;
    int ax = 0, ay = 0, bx = 0, by = 0, cx = 0, cy = 0;
    if (id & 1) {
      bx = by = cx = tile;
    } else {
      ax = ay = cy = tile;
    }
    while ((id >>= 1) > 1) {
      const int mx = (ax + bx) >> 1, my = (ay + by) >> 1;
      if (id & 1) {
        bx = ax, by = ay;
        ax = cx, ay = cy;
      } else {
        ax = bx, ay = by;
        bx = cx, by = cy;
      }
      cx = mx, cy = my;
    }
    const int mx = (ax + bx) >> 1, my = (ay + by) >> 1;
    cx = mx + my - ay;
    cy = my + ax - mx;
    const double mean = (static_cast<double>(terrain[at(ax, ay)]) + static_cast<double>(terrain[at(bx, by)])) / 2;
    const auto error = static_cast<float>(std::abs(mean - static_cast<double>(terrain[at(mx, my)])));
    float& here = errors[at(mx, my)];
    here = std::max(here, error);
    if (i < parents) {
      here = std::max({here, errors[at((ax + cx) >> 1, (ay + cy) >> 1)], errors[at((bx + cx) >> 1, (by + cy) >> 1)]});
    }
  }
  return errors;
}

int martini_triangles(const std::vector<float>& errors, int size, float tolerance, int ax, int ay, int bx, int by, int cx, int cy) {
  const int mx = (ax + bx) >> 1, my = (ay + by) >> 1;
  if (std::abs(ax - cx) + std::abs(ay - cy) > 1 && errors[static_cast<std::size_t>(my * size + mx)] > tolerance) {
    return martini_triangles(errors, size, tolerance, cx, cy, ax, ay, mx, my) +
           martini_triangles(errors, size, tolerance, bx, by, cx, cy, mx, my);
  }
  return 1;
}

/// Hills of all sizes, `relief` metres high.
template <class T>
std::vector<T> hills(int side, double relief, std::mt19937_64& random) {
  std::uniform_real_distribution<double> phase(0, 6.28);
  std::vector<double> sum(static_cast<std::size_t>(side * side), 0.0);
  for (double waves = 1, height = 1; waves <= std::max(1.0, side / 4.0); waves *= 2, height /= 2) {
    for (int i = 0; i < 3; ++i) {
      const double angle = phase(random), start = phase(random), k = waves * 6.28 / side;
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          sum[static_cast<std::size_t>(y * side + x)] += height * std::sin(k * (x * std::cos(angle) + y * std::sin(angle)) + start);
        }
      }
    }
  }
  const auto [low, high] = std::minmax_element(sum.begin(), sum.end());
  std::vector<T> heights;
  for (const double h : sum) heights.push_back(static_cast<T>((h - *low) / (*high - *low) * relief));
  return heights;
}

struct Corner {
  int x, y;
};
std::array<Corner, 3> corners(const GridTriangles& mesh, std::size_t triangle, int side) {
  std::array<Corner, 3> c{};
  for (std::size_t j = 0; j < 3; ++j) {
    const int p = static_cast<int>(mesh.points[mesh.indices[3 * triangle + j]]);
    c[j] = {p % side, p / side};
  }
  return c;
}

}  // namespace

TEST_CASE("midpoint_errors: equal those of martini's own algorithm to the bit, and so do the triangle counts") {
  std::mt19937_64 random(20260711);
  for (const int side : {3, 5, 9, 33, 65, 257}) {
    CAPTURE(side);
    const std::vector<float> heights = hills<float>(side, 1000, random);
    const std::vector<float> errors = midpoint_errors(heights, side);
    REQUIRE(errors == martini_errors(heights, side));
    for (const float tolerance : {0.0f, 0.5f, 10.0f, 100.0f, 1e6f}) {
      const int last = side - 1;
      const int expected = martini_triangles(errors, side, tolerance, 0, 0, last, last, last, 0) +
                           martini_triangles(errors, side, tolerance, last, last, 0, 0, 0, last);
      CHECK(extract_triangles(errors, side, tolerance).indices.size() == static_cast<std::size_t>(expected) * 3);
    }
  }
}

TEST_CASE("extract_triangles: fill the square once, counter-clockwise, without T-junctions, each point once") {
  const auto seed = std::random_device{}();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const int side = 65;
  const std::vector<double> heights = hills<double>(side, 1000, random);
  const std::vector<float> errors = true_errors(heights, side);
  for (const float tolerance : {0.0f, 3.0f, 20.0f, 150.0f, 1e6f}) {
    CAPTURE(tolerance);
    const GridTriangles mesh = extract_triangles(errors, side, tolerance);
    CHECK(std::set<std::uint32_t>(mesh.points.begin(), mesh.points.end()).size() == mesh.points.size());
    int doubled_area = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
      const auto c = corners(mesh, t, side);
      const int turn = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y);
      REQUIRE(turn < 0);  // rows run downwards
      doubled_area -= turn;
      for (std::size_t j = 0; j < 3; ++j) {
        ++edges[{mesh.points[mesh.indices[3 * t + j]], mesh.points[mesh.indices[3 * t + (j + 1) % 3]]}];
      }
    }
    CHECK(doubled_area == 2 * (side - 1) * (side - 1));
    for (const auto& [edge, count] : edges) {
      REQUIRE(count == 1);
      const int x0 = static_cast<int>(edge.first) % side, y0 = static_cast<int>(edge.first) / side;
      const int x1 = static_cast<int>(edge.second) % side, y1 = static_cast<int>(edge.second) / side;
      const bool border = (x0 == x1 && (x0 == 0 || x0 == side - 1)) || (y0 == y1 && (y0 == 0 || y0 == side - 1));
      // An edge inside the square belongs to two triangles, whole: a T-junction would leave one side without its twin.
      REQUIRE(edges.contains({edge.second, edge.first}) != border);
    }
  }
}

TEST_CASE("true_errors: a mesh stays within its tolerance at every grid point, where martini's criterion does not") {
  const auto seed = std::random_device{}();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const int side = 65;
  int martini_beyond = 0;
  for (int round = 0; round < 200; ++round) {
    const std::vector<double> heights = hills<double>(side, 1000, random);
    const std::vector<float> rough(heights.begin(), heights.end());
    for (const float tolerance : {2.0f, 10.0f, 40.0f}) {
      const GridTriangles mesh = extract_triangles(true_errors(heights, side), side, tolerance);
      CHECK(largest_deviation(mesh, heights, side) <= static_cast<double>(tolerance));
      const GridTriangles martini = extract_triangles(midpoint_errors(rough, side), side, tolerance);
      if (largest_deviation(martini, heights, side) > static_cast<double>(tolerance)) ++martini_beyond;
    }
  }
  CHECK(martini_beyond > 300);  // half of them: over fewer rounds chance decides
}

TEST_CASE("largest_deviation: agrees with a direct search over the triangles of every grid point") {
  const auto seed = std::random_device{}();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const int side = 17;
  const std::vector<double> heights = hills<double>(side, 100, random);
  const GridTriangles mesh = extract_triangles(true_errors(heights, side), side, 15.0f);
  double largest = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
        const auto c = corners(mesh, t, side);
        const double det = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y);
        const double l1 = ((x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (y - c[0].y)) / det;
        const double l2 = ((c[1].x - c[0].x) * (y - c[0].y) - (x - c[0].x) * (c[1].y - c[0].y)) / det;
        if (l1 < 0 || l2 < 0 || l1 + l2 > 1) continue;
        const auto h = [&](std::size_t j) { return heights[static_cast<std::size_t>(c[j].y * side + c[j].x)]; };
        const double shown = (1 - l1 - l2) * h(0) + l1 * h(1) + l2 * h(2);
        largest = std::max(largest, std::abs(shown - heights[static_cast<std::size_t>(y * side + x)]));
      }
    }
  }
  REQUIRE(largest > 5);
  CHECK(largest_deviation(mesh, heights, side) == doctest::Approx(largest).epsilon(1e-12));
}

TEST_CASE("interpolate_in_triangles: is linear on every triangle of the full network") {
  const int side = 9;
  std::mt19937_64 random(5);
  const std::vector<double> heights = hills<double>(side, 100, random);
  const GridTriangles full = extract_triangles(std::vector<float>(81, 1.0f), side, 0.0f);
  REQUIRE(full.indices.size() == 3 * 2 * 64);
  for (std::size_t t = 0; t < full.indices.size() / 3; ++t) {
    const auto c = corners(full, t, side);
    const std::array<double, 3> share{0.2, 0.3, 0.5};
    double x = 0, y = 0, expected = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      x += share[j] * c[j].x;
      y += share[j] * c[j].y;
      expected += share[j] * heights[static_cast<std::size_t>(c[j].y * side + c[j].x)];
    }
    REQUIRE(interpolate_in_triangles(heights, side, x, y) == doctest::Approx(expected).epsilon(1e-12));
  }
}
