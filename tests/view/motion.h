// Cameras for tests, and where they see a point.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <string>

#include "view/camera.h"

namespace tellurion::view {

inline constexpr double kPi = std::numbers::pi;

inline Camera camera_at(const std::string& pose) {
  return make_camera(geo::kWgs84, parse_pose(pose).value(), to_radians(Degrees(45.0)), 1280, 720);
}

/// The pixel in which `camera` sees `point`, from the definition of a perspective picture.
inline glm::dvec2 pixel_of(const Camera& camera, const geo::Point<geo::Ecef>& point) {
  const glm::dvec3 relative = point.xyz - camera.eye.xyz;
  const double depth = -glm::dot(relative, camera.axes[2]);
  const double focal_px = camera.height / 2.0 / std::tan(camera.vertical_fov.value / 2.0);
  return {camera.width / 2.0 + focal_px * glm::dot(relative, camera.axes[0]) / depth,
          camera.height / 2.0 - focal_px * glm::dot(relative, camera.axes[1]) / depth};
}

/// A camera near any place (poles and antimeridian often), at 10 m to 20,000 km, that looks to the ground in any
/// attitude.
inline Camera random_camera(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Pose pose;
  pose.position = {Radians(std::asin(unit(random))), Radians(kPi * unit(random)), EllipsoidalHeight(0.0)};
  switch (random() % 4) {
    case 0:
      pose.position.latitude = Radians((unit(random) < 0.0 ? -1.0 : 1.0) * (kPi / 2.0 - 1e-4 * std::abs(unit(random))));
      break;
    case 1:
      pose.position.longitude = Radians(kPi + 1e-4 * unit(random));
      break;
    default:
      break;
  }
  pose.position.height = EllipsoidalHeight(std::pow(10.0, 4.15 + 3.15 * unit(random)));
  pose.heading = Radians(kPi * unit(random));
  pose.pitch = Radians(-kPi / 2.0 + 0.6 * std::abs(unit(random)));
  pose.roll = Radians(kPi * unit(random));
  return make_camera(geo::kWgs84, pose, to_radians(Degrees(45.0)), 1280, 720);
}

inline glm::dvec2 random_pixel(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  return {1280.0 * unit(random), 720.0 * unit(random)};
}

}  // namespace tellurion::view
