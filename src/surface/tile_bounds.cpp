#include "surface/tile_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "surface/tile_content.h"

namespace tellurion::surface {
namespace {

glm::dvec3 normal_at(const geo::TileKey& key, double s, double t) { return geo::tile_normal(key, {s, t}).xyz; }

glm::dvec3 ground_at(const geo::Ellipsoid& ellipsoid, const glm::dvec3& normal) {
  return geo::surface_point(ellipsoid, {normal}).xyz;
}

/// Bound of the second derivative of a point of the tile, at any height up to `height`, by either of the face's angles
/// (u pi/4, v pi/4). With a fixed, the normal runs along a great circle by an angle phi(b), |phi'| <= 1, |phi''| <= 0.63
/// on the face. The ellipsoid's point is D n / sqrt(n.D n), D = diag(a^2, a^2, b^2); differentiated twice along a great
/// circle its length is at most a^2/b (1 + 2 d + 3/4 d^2), d = (a^2 - b^2) / b^2.
double curve_bound(const geo::Ellipsoid& ellipsoid, double height) {
  const double a2 = ellipsoid.a() * ellipsoid.a();
  const double b2 = ellipsoid.b() * ellipsoid.b();
  const double flat = a2 / b2;  // 1 + d
  return 1.63 * (a2 / ellipsoid.b() * flat * flat + height);
}

}  // namespace

TileShape tile_shape(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key) {
  const glm::dvec3 up = normal_at(key, 0.5, 0.5);
  const auto ground = [&](double s, double t) { return ground_at(ellipsoid, normal_at(key, s, t)); };
  // The tile as a parallelogram: its stretch is the larger singular value of (along s, along t). Chords fall short of arcs
  // by the angle's half over its sine.
  const double half_angle = geo::tile_angle(key.level).value / 2;
  const double arc = half_angle / std::sin(half_angle);
  const glm::dvec3 along_s = arc * (ground(1, 0.5) - ground(0, 0.5));
  const glm::dvec3 along_t = arc * (ground(0.5, 1) - ground(0.5, 0));
  const double ss = glm::dot(along_s, along_s);
  const double tt = glm::dot(along_t, along_t);
  const double st = glm::dot(along_s, along_t);
  TileShape shape;
  shape.up = up;
  shape.size = std::sqrt((ss + tt) / 2 + std::hypot((ss - tt) / 2, st));
  shape.grid_diagonal = std::sqrt(ss + tt + 2 * std::abs(st)) / (kGridSide - 1);
  for (int corner = 0; corner < 4; ++corner) {  // edges are great circles: the farthest normal is a corner's
    const double chord = glm::length(normal_at(key, corner & 1, corner >> 1) - up);
    shape.cone = std::max(shape.cone, 2 * std::asin(std::min(1.0, chord / 2)));
  }
  return shape;
}

OrientedBox tile_box(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key, double lowest, double highest) {
  OrientedBox box;
  const glm::dvec3 up = normal_at(key, 0.5, 0.5);
  const glm::dvec3 across = normal_at(key, 1, 0.5) - normal_at(key, 0, 0.5);
  const glm::dvec3 tangent = glm::normalize(across - glm::dot(across, up) * up);
  box.axes = {tangent, glm::cross(up, tangent), up};
  const glm::dmat3 to_box = glm::transpose(box.axes);

  // Along an axis, a point is linear in its height and nearly linear between the points of a grid: the extremes over the
  // grid at both heights, widened by the remainder of bilinear interpolation.
  const int cells = key.level < 3 ? 8 : 4;
  const glm::dvec3 origin = ground_at(ellipsoid, up);
  glm::dvec3 least(std::numeric_limits<double>::infinity());
  glm::dvec3 most = -least;
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) {
      const glm::dvec3 normal = normal_at(key, static_cast<double>(column) / cells, static_cast<double>(row) / cells);
      const glm::dvec3 ground = to_box * (ground_at(ellipsoid, normal) - origin);
      const glm::dvec3 direction = to_box * normal;
      const glm::dvec3 low = ground + lowest * direction;
      const glm::dvec3 high = ground + highest * direction;
      least = glm::min(least, glm::min(low, high));
      most = glm::max(most, glm::max(low, high));
    }
  }
  const double step = geo::tile_angle(key.level).value / cells;
  const double remainder = 2 * step * step / 8 * curve_bound(ellipsoid, std::max(std::abs(lowest), std::abs(highest)));
  const double rounding = 16 * std::numeric_limits<double>::epsilon() *
                          (ellipsoid.a() + std::max(std::abs(lowest), std::abs(highest)));
  box.half = (most - least) / 2.0 + (remainder + rounding);
  box.centre = origin + box.axes * ((least + most) / 2.0);
  return box;
}

double distance_to(const OrientedBox& box, const glm::dvec3& point) {
  const glm::dvec3 local = glm::abs((point - box.centre) * box.axes);  // row vector: dot with each axis
  return glm::length(glm::max(local - box.half, glm::dvec3(0.0)));
}

ViewVolume make_view_volume(const view::Camera& camera) {
  const view::Frustum frustum = view::make_frustum(camera);
  return {camera.eye.xyz,
          {frustum.inward[0], frustum.inward[1], frustum.inward[2], frustum.inward[3], frustum.forward}};
}

std::optional<PlaneSet> planes_crossed(const ViewVolume& volume, const OrientedBox& box, PlaneSet planes) {
  const glm::dvec3 from_eye = box.centre - volume.eye;
  PlaneSet crossed = 0;
  for (unsigned i = 0; i < volume.inward.size(); ++i) {
    if ((planes >> i & 1u) == 0) continue;
    const glm::dvec3& inward = volume.inward[i];
    const double middle = glm::dot(inward, from_eye);
    const double reach = glm::dot(glm::abs(inward * box.axes), box.half);
    if (middle + reach < 0) return std::nullopt;
    if (middle - reach < 0) crossed |= 1u << i;
  }
  return crossed;
}

Horizon::Horizon(const geo::Ellipsoid& ellipsoid, const glm::dvec3& eye, double lowest) {
  // A point of the ellipsoid shrunk by k lies at least (1 - k) b below the surface.
  const double shrunk = 1 + std::min(lowest, 0.0) / ellipsoid.b();
  if (shrunk <= 0.01) return;  // no solid core worth a test
  scale_ = glm::dvec3(1 / (shrunk * ellipsoid.a()), 1 / (shrunk * ellipsoid.a()), 1 / (shrunk * ellipsoid.b()));
  eye_ = eye * scale_;
  tangent_squared_ = glm::dot(eye_, eye_) - 1;
}

bool Horizon::hides(const glm::dvec3& from_eye) const {
  const double inward = -glm::dot(from_eye, eye_);
  return inward > tangent_squared_ && inward * inward > tangent_squared_ * glm::dot(from_eye, from_eye);
}

bool Horizon::hides(const OrientedBox& box) const {
  if (tangent_squared_ <= 0) return false;
  const glm::dvec3 centre = box.centre * scale_ - eye_;
  if (!hides(centre)) return false;
  const glm::dvec3 x = box.axes[0] * box.half[0] * scale_;
  const glm::dvec3 y = box.axes[1] * box.half[1] * scale_;
  const glm::dvec3 z = box.axes[2] * box.half[2] * scale_;
  for (int corner = 0; corner < 8; ++corner) {
    if (!hides(centre + (corner & 1 ? x : -x) + (corner & 2 ? y : -y) + (corner & 4 ? z : -z))) return false;
  }
  return true;
}

}  // namespace tellurion::surface
