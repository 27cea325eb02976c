#include "surface/tile_mesh.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

#include <glm/geometric.hpp>

#include "surface/rtin.h"
#include "surface/tile_grid.h"

namespace tellurion::surface {
namespace {

constexpr std::size_t kPointCount = static_cast<std::size_t>(kGridSide) * static_cast<std::size_t>(kGridSide);

/// Height of the arc of curvature `radius` over a chord of the given squared length.
double sag(double squared_chord, double radius) {
  const double half = squared_chord / 4.0;
  return half / (radius + std::sqrt(std::max(0.0, radius * radius - half)));
}

/// Squared diameter of the smallest circle round a triangle.
double squared_diameter(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double ab = glm::dot(b - a, b - a), bc = glm::dot(c - b, c - b), ca = glm::dot(a - c, a - c);
  const double longest = std::max({ab, bc, ca});
  if (ab + bc + ca <= 2.0 * longest) return longest;  // right or obtuse
  const glm::dvec3 twice_area = glm::cross(b - a, c - a);
  return ab * bc * ca / glm::dot(twice_area, twice_area);
}

/// Largest slope of the plane through three points of `base` raised by heights; metres per metre.
double slope_of(const std::array<glm::dvec3, 3>& base, const std::array<double, 3>& heights) {
  const glm::dvec3 ab = base[1] - base[0], ac = base[2] - base[0];
  const double hb = heights[1] - heights[0], hc = heights[2] - heights[0];
  const double squared_area = glm::dot(glm::cross(ab, ac), glm::cross(ab, ac));
  const glm::dvec3 rise = hb * ac - hc * ab;  // turned by a right angle and scaled by the area: the gradient
  return std::sqrt(glm::dot(rise, rise) / squared_area);
}

/// Raises the errors of hypotenuses (in units of the height tolerance) to those that curvature asks for.
/// A chord's sag depends on its length alone, and at every level of the network chords are of nearly one length: that of
/// the largest tile is taken for all, so that a border is split alike from both sides.
void add_curvature(std::span<float> errors, double tile_size, double radius, double tolerance) {
  for (int half = 1; 2 * half < kGridSide; half *= 2) {
    const double leg = tile_size * 2.0 * half / (kGridSide - 1);
    const auto axial = static_cast<float>(sag(leg * leg, radius) / tolerance);
    const auto diagonal = static_cast<float>(sag(2.0 * leg * leg, radius) / tolerance);
    for (int y = 0; y < kGridSide; y += half) {
      for (int x = 0; x < kGridSide; x += half) {
        const bool odd_x = ((x / half) & 1) != 0, odd_y = ((y / half) & 1) != 0;
        if (!odd_x && !odd_y) continue;
        float& error = errors[static_cast<std::size_t>(y * kGridSide + x)];
        error = std::max(error, odd_x && odd_y ? diagonal : axial);
      }
    }
  }
}

/// How far triangles are from the full grid. `base`: the grid's points on the ellipsoid.
DecimatedStep deviations_of(const GridTriangles& triangles, std::span<const glm::dvec3> base, std::span<const double> heights,
                            double tightest_radius) {
  DecimatedStep out;
  // A flat triangle also shifts its inside sideways against the grid's equi-angular coordinates: by less than
  // diameter^2 / (8 radius), measured over all triangles of a face (0.94 of it at worst), the same as its sag.
  for (std::size_t i = 0; i < triangles.indices.size(); i += 3) {
    std::array<glm::dvec3, 3> corner;
    std::array<double, 3> height{};
    for (std::size_t j = 0; j < 3; ++j) {
      const std::uint32_t point = triangles.points[triangles.indices[i + j]];
      corner[j] = base[point];
      height[j] = heights[point];
    }
    const double sag_here = sag(squared_diameter(corner[0], corner[1], corner[2]), tightest_radius);
    out.curvature_deviation = std::max(out.curvature_deviation, sag_here);
    out.sideways_deviation = std::max(out.sideways_deviation, sag_here * slope_of(corner, height));
  }
  out.drawn = drawn_heights(triangles, heights, kGridSide);
  for (std::size_t i = 0; i < kPointCount; ++i) {
    out.height_deviation = std::max(out.height_deviation, std::abs(out.drawn[i] - heights[i]));
  }
  out.height_deviation += out.sideways_deviation;
  return out;
}

/// Adds walls below border edges; their outer sides are the front.
class Skirt {
 public:
  /// `points`: grid index of every vertex of the surface.
  Skirt(TileMesh& mesh, std::span<const std::uint32_t> points) : mesh_(mesh), points_(points), top_of_(points.size(), kNone) {}

  /// Below the border of the surface that the indices from `first` on make.
  void add(std::size_t first) {
    std::array<std::vector<OnBorder>, 4> sides;  // clockwise round the tile as seen from outside, north first
    std::vector<bool> seen(points_.size(), false);
    for (std::size_t i = first; i < mesh_.indices.size(); ++i) {
      const std::uint16_t vertex = mesh_.indices[i];
      if (seen[vertex]) continue;
      seen[vertex] = true;
      const int x = static_cast<int>(points_[vertex]) % kGridSide, y = static_cast<int>(points_[vertex]) / kGridSide;
      if (y == 0) sides[0].push_back({x, vertex});
      if (x == kLast) sides[1].push_back({y, vertex});
      if (y == kLast) sides[2].push_back({kLast - x, vertex});
      if (x == 0) sides[3].push_back({kLast - y, vertex});
    }
    for (std::vector<OnBorder>& side : sides) {
      std::sort(side.begin(), side.end(), [](const OnBorder& l, const OnBorder& r) { return l.along < r.along; });
      for (std::size_t i = 0; i + 1 < side.size(); ++i) {
        const std::uint16_t a = top(side[i].vertex), b = top(side[i + 1].vertex);
        const auto below_a = static_cast<std::uint16_t>(a + 1), below_b = static_cast<std::uint16_t>(b + 1);
        for (const std::uint16_t index : {a, b, below_b, a, below_b, below_a}) mesh_.indices.push_back(index);
      }
    }
  }

 private:
  static constexpr int kLast = kGridSide - 1;
  static constexpr std::uint16_t kNone = 0xffff;
  struct OnBorder {
    int along;
    std::uint16_t vertex;
  };

  /// The skirt's vertex at a vertex of the surface; that of the lower rim follows it.
  std::uint16_t top(std::uint16_t surface) {
    if (top_of_[surface] == kNone) {
      top_of_[surface] = static_cast<std::uint16_t>(mesh_.vertices.size());
      TileVertex vertex = mesh_.vertices[surface];
      for (const float skirt : {kSkirtTop, kSkirtRim}) {
        vertex.skirt = skirt;
        mesh_.vertices.push_back(vertex);
      }
    }
    return top_of_[surface];
  }

  TileMesh& mesh_;
  std::span<const std::uint32_t> points_;
  std::vector<std::uint16_t> top_of_;
};

/// Triangulations of errors in units of the finest tolerance, finest first.
std::vector<GridTriangles> triangulations(std::span<const float> errors, const MeshLimits& limits) {
  constexpr double kFewer = 0.8;              // a step that saves less is none
  constexpr std::size_t kFewTriangles = 128;  // below that there is nothing to save
  constexpr int kHopeless = 100;              // heights that no tolerance reaches
  std::vector<GridTriangles> steps;
  double scale = 1.0;
  for (int i = 0; i < limits.most_steps || steps.empty(); ++i, scale *= limits.step_ratio) {
    GridTriangles triangles = extract_triangles(errors, kGridSide, static_cast<float>(scale));
    const std::size_t count = triangles.indices.size() / 3;
    if (count > limits.most_triangles && i < kHopeless) continue;
    if (!steps.empty() && static_cast<double>(count) > kFewer * static_cast<double>(steps.back().indices.size() / 3)) continue;
    steps.push_back(std::move(triangles));
    if (count < kFewTriangles) break;
  }
  return steps;
}

}  // namespace

DecimatedMesh make_tile_mesh(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key,
                             std::span<const geo::Vector<geo::Ecef>> normals, std::span<const double> heights,
                             std::span<const double> parent_heights, const MeshTolerance& tolerance, const MeshLimits& limits) {
  assert(normals.size() == kPointCount && heights.size() == kPointCount && parent_heights.size() == kPointCount);
  const geo::Vector<geo::Ecef> origin_up = geo::tile_normal(key, {0.5, 0.5});
  const geo::Point<geo::Ecef> origin = geo::surface_point(ellipsoid, origin_up);
  std::vector<glm::dvec3> base(kPointCount);
  for (std::size_t i = 0; i < kPointCount; ++i) base[i] = (geo::surface_point(ellipsoid, normals[i]) - origin).xyz;

  // No normal section of an oblate ellipsoid is curved more than the meridian at the equator.
  const double tightest_radius = ellipsoid.b() * ellipsoid.b() / ellipsoid.a();
  std::vector<float> errors = true_errors(heights, kGridSide);
  for (float& error : errors) error = static_cast<float>(error / tolerance.height);
  add_curvature(errors, nominal_tile_size(ellipsoid, key.level), tightest_radius, tolerance.curvature);
  saturate_errors(errors, kGridSide);
  const std::vector<GridTriangles> steps = triangulations(errors, limits);

  DecimatedMesh out;
  TileMesh& mesh = out.mesh;
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  mesh.origin_base = origin;
  mesh.origin_up = origin_up;
  mesh.reference_height = (*lowest + *highest) / 2.0;
  // The coarser triangulations' points are among those of the finest.
  const std::vector<std::uint32_t>& points = steps.front().points;
  std::vector<std::uint16_t> vertex_of(kPointCount);
  double rounding = 0;  // of the vertices to floats: triangles sink by no more than their corners
  mesh.vertices.reserve(points.size() + 8 * kGridSide);
  for (const std::uint32_t point : points) {
    vertex_of[point] = static_cast<std::uint16_t>(mesh.vertices.size());
    TileVertex vertex;
    vertex.base = glm::vec3(base[point]);
    rounding = std::max(rounding, glm::distance(glm::dvec3(vertex.base), base[point]));
    vertex.up_offset = glm::vec3((normals[point] - origin_up).xyz);
    vertex.height = static_cast<float>(heights[point] - mesh.reference_height);
    vertex.parent_height = static_cast<float>(parent_heights[point] - mesh.reference_height);
    vertex.st = glm::vec2(static_cast<float>(point % kGridSide), static_cast<float>(point / kGridSide)) /
                static_cast<float>(kGridSide - 1);
    vertex.skirt = 0.0f;
    mesh.vertices.push_back(vertex);
  }
  Skirt skirt(mesh, points);
  for (const GridTriangles& triangles : steps) {
    MeshStep step;
    step.first_index = static_cast<std::uint32_t>(mesh.indices.size());
    for (const std::uint32_t index : triangles.indices) mesh.indices.push_back(vertex_of[triangles.points[index]]);
    step.surface_index_count = static_cast<std::uint32_t>(triangles.indices.size());
    skirt.add(step.first_index);
    step.index_count = static_cast<std::uint32_t>(mesh.indices.size()) - step.first_index;
    mesh.steps.push_back(step);
    out.steps.push_back(deviations_of(triangles, base, heights, tightest_radius));
    out.steps.back().curvature_deviation += rounding;
  }
  return out;
}

}  // namespace tellurion::surface
