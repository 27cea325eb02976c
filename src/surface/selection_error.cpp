#include "surface/selection_error.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace tellurion::surface {
namespace {

constexpr double kSlotTexels = kColourSlotSide - 2 * kColourGutter;

}  // namespace

DisplayedError displayed_error(const ErrorView& view, const MeshError& error, double max_height) {
  const double raised = 1 + view.exaggeration * std::max(max_height, 0.0) / view.body_radius;
  const double curvature = static_cast<double>(error.curvature) * raised;
  return {static_cast<double>(judged(error.height)) * view.exaggeration + curvature,
          static_cast<double>(error.height.bound) * view.exaggeration + curvature};
}

float full_grid_curvature_error(const geo::Ellipsoid& ellipsoid, const TileShape& shape) {
  const double smallest_radius = ellipsoid.b() * ellipsoid.b() / ellipsoid.a();
  return static_cast<float>(shape.grid_diagonal * shape.grid_diagonal / (8 * smallest_radius));
}

double precision_metres(const TileShape& shape) { return 4 * 1e-7 * shape.size; }

double texel_metres(const TileShape& shape) { return shape.size / kSlotTexels; }

double visible_share(const ErrorView& view, const TileShape& shape, const OrientedBox& box, double relief) {
  const glm::dvec3 to_eye = view.eye - box.centre;
  const double distance = glm::length(to_eye);
  const double radius = glm::length(box.half);
  if (distance <= radius) return 1;
  const double off_normal = std::acos(std::clamp(glm::dot(to_eye, shape.up) / distance, -1.0, 1.0));
  const double spread = shape.cone + std::atan(2 * relief / shape.size) + std::asin(radius / distance);
  const double sine = std::cos(std::max(0.0, off_normal - spread));
  return std::clamp(view.anisotropy * sine, 0.0, 1.0);
}

double split_distance_in_sizes(const ErrorView& view, double sse_px) { return 1 / (kSlotTexels * view.pixel_angle * sse_px); }

double split_solid_angle(const ErrorView& view, double sse_px) {
  const double angle = kSlotTexels * view.pixel_angle * sse_px;
  return angle * angle;
}

}  // namespace tellurion::surface
