#include "view/controllers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "view/rotation.h"

namespace tellurion::view {
namespace {

using EcefPoint = geo::Point<geo::Ecef>;

constexpr double kZoomPerStep = 0.9;
constexpr double kSlowestFlight = 2.0;  // metres per second
constexpr double kHalfPi = std::numbers::pi / 2.0;
constexpr Radians kHighestOrbitPitch = to_radians(Degrees(5.0));

glm::dvec3 up_at(const geo::Ellipsoid& ellipsoid, const EcefPoint& point) {
  return geo::normal_at(geo::place_of(geo::to_geodetic(ellipsoid, point))).xyz;
}

double height_of(const geo::Ellipsoid& ellipsoid, const EcefPoint& point) {
  return geo::to_geodetic(ellipsoid, point).height.value;
}

Camera rotated(Camera camera, const glm::dmat3& rotation, const EcefPoint& pivot) {
  camera.eye = pivot + geo::Vector<geo::Ecef>{rotation * (camera.eye - pivot).xyz};
  camera.axes = orthonormal(rotation * camera.axes);
  return camera;
}

/// Where `pixel` meets the sphere of `radius` around the planet's centre, on the way in or on the way out.
std::optional<EcefPoint> meet_sphere(const Camera& camera, glm::dvec2 pixel, double radius, bool on_the_way_out) {
  const geo::Vector<geo::Ecef> ray = camera.ray(pixel);
  const double to_closest = -glm::dot(camera.eye.xyz, ray.xyz);
  const double closest = glm::length((camera.eye + ray * to_closest).xyz);
  if (closest > radius) return std::nullopt;
  const double half_chord = std::sqrt((radius - closest) * (radius + closest));
  const double t = on_the_way_out ? to_closest + half_chord : to_closest - half_chord;
  if (t < 0.0) return std::nullopt;
  return camera.eye + ray * t;
}

}  // namespace

Camera pan(const geo::Ellipsoid& ellipsoid, const Camera& camera, const EcefPoint& grabbed, glm::dvec2 pixel) {
  const double radius = glm::length(grabbed.xyz);
  const bool on_the_way_out = glm::dot((grabbed - camera.eye).xyz, grabbed.xyz) > 0.0;
  const double height = height_of(ellipsoid, camera.eye);
  glm::dvec3 up = up_at(ellipsoid, camera.eye);
  Camera moved = camera;
  // Turning the camera around the planet's centre brings any point under the pixel, in any attitude. On a sphere that
  // is all; on an ellipsoid, height and attitude change a little: set them right and turn again, a last time without
  // setting right.
  constexpr int kTurns = 5;
  for (int i = 0; i < kTurns; ++i) {
    const std::optional<EcefPoint> seen = meet_sphere(moved, pixel, radius, on_the_way_out);
    if (!seen) return camera;
    const glm::dmat3 rotation = turn_between(seen->xyz, grabbed.xyz).part(1.0);
    moved = rotated(moved, rotation, {});
    if (i + 1 == kTurns) break;
    const glm::dvec3 new_up = up_at(ellipsoid, moved.eye);
    moved.axes = turn_between(rotation * up, new_up).part(1.0) * moved.axes;
    moved.eye.xyz += new_up * (height - height_of(ellipsoid, moved.eye));
    up = new_up;
  }
  return moved;
}

Camera zoom(const Camera& camera, const EcefPoint& target, double steps) {
  Camera moved = camera;
  moved.eye = target + (camera.eye - target) * std::pow(kZoomPerStep, steps);
  return moved;
}

Camera orbit(const geo::Ellipsoid& ellipsoid, const Camera& camera, const EcefPoint& pivot, Radians turn,
             Radians tilt) {
  const glm::dvec3 up = up_at(ellipsoid, pivot);
  const glm::dvec3 forward = camera.forward().xyz;
  const glm::dvec3 across = glm::cross(forward, up);
  const double level = glm::length(across);
  const double pitch = std::atan2(glm::dot(forward, up), level);
  // Straight down, the way to tilt is the picture's.
  const glm::dvec3 sideways =
      level > 1e-9 ? across / level : glm::normalize(camera.axes[0] - up * glm::dot(camera.axes[0], up));
  const double highest = std::max(pitch, kHighestOrbitPitch.value);
  const double new_pitch = std::clamp(pitch + tilt.value, -kHalfPi, highest);
  return rotated(camera, rotation_about(up, -turn.value) * rotation_about(sideways, new_pitch - pitch), pivot);
}

Camera look_around(const geo::Ellipsoid& ellipsoid, const Camera& camera, Radians turn, Radians tilt) {
  Pose pose = pose_of(ellipsoid, camera);
  pose.heading += turn;
  pose.pitch = Radians(std::clamp(pose.pitch.value + tilt.value, -kHalfPi, kHalfPi));
  Camera turned = camera;
  turned.axes = axes_of(pose);
  return turned;
}

Camera north_up(const geo::Ellipsoid& ellipsoid, const Camera& camera) {
  Pose pose = pose_of(ellipsoid, camera);
  pose.heading = pose.roll = Radians(0.0);
  Camera turned = camera;
  turned.axes = axes_of(pose);
  return turned;
}

Camera fly(const Ground& ground, const Camera& camera, glm::dvec3 motion, double seconds) {
  const double speed = std::max(kSlowestFlight, clearance_of(ground, camera));
  const glm::dvec3 step = camera.axes * glm::dvec3(motion.x, motion.y, -motion.z) * (speed * seconds);
  const glm::dvec3 up = up_at(ground.ellipsoid, camera.eye);
  const double height = height_of(ground.ellipsoid, camera.eye) + glm::dot(step, up);
  Camera moved = camera;
  moved.eye.xyz += step;
  const glm::dvec3 new_up = up_at(ground.ellipsoid, moved.eye);
  moved.eye.xyz += new_up * (height - height_of(ground.ellipsoid, moved.eye));
  moved.axes = orthonormal(turn_between(up, new_up).part(1.0) * camera.axes);
  return moved;
}

Camera keep_above(const Ground& ground, const Camera& camera, Metres clearance) {
  const double missing = clearance.value - clearance_of(ground, camera);
  if (missing <= 0.0) return camera;
  Camera lifted = camera;
  lifted.eye.xyz += up_at(ground.ellipsoid, camera.eye) * missing;
  return lifted;
}

Camera home(const geo::Ellipsoid& ellipsoid, Radians longitude, Radians vertical_fov, int width, int height) {
  constexpr double kShare = 0.85;  // of the picture's shorter side
  const double half_side = std::tan(vertical_fov.value / 2.0) * std::min(1.0, static_cast<double>(width) / height);
  const double distance = ellipsoid.a() / std::sin(std::atan(kShare * half_side));
  Pose pose;
  pose.position = {to_radians(Degrees(20.0)), longitude, EllipsoidalHeight(distance - ellipsoid.a())};
  return make_camera(ellipsoid, pose, vertical_fov, width, height);
}

}  // namespace tellurion::view
