#include "view/camera.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <string>

#include "base/number.h"

namespace tellurion::view {
namespace {

constexpr double kFarthestHeight = 1e12;  // metres; the Sun is at 1.5e11

}  // namespace

Result<Pose> parse_pose(std::string_view text) {
  const auto fail = [&](const std::string& why) {
    return Error{ErrorCode::invalid_argument,
                 "camera '" + std::string(text.substr(0, 120)) + "': " + why +
                     " (wanted: lat,lon,height[,heading[,pitch[,roll]]] in degrees and metres)"};
  };
  constexpr std::array<const char*, 6> kNames{"lat", "lon", "height", "heading", "pitch", "roll"};
  std::array<double, 6> numbers{0.0, 0.0, 0.0, 0.0, -90.0, 0.0};
  std::size_t count = 0;
  for (std::string_view rest = text;;) {
    const std::size_t comma = rest.find(',');
    if (count == numbers.size()) return fail("more than 6 numbers");
    const std::optional<double> number = parse_number(rest.substr(0, comma));
    if (!number) return fail(std::string(kNames[count]) + " is no number");
    numbers[count++] = *number;
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (count < 3) return fail("fewer than 3 numbers");
  if (std::abs(numbers[0]) > 90.0) return fail("lat is beyond 90 degrees");
  if (std::abs(numbers[2]) > kFarthestHeight) return fail("height is beyond 1e12 m");
  if (std::abs(numbers[4]) > 90.0) return fail("pitch is beyond 90 degrees");
  const auto angle = [&](std::size_t i) { return to_radians(Degrees(numbers[i])); };
  return Pose{{angle(0), angle(1), EllipsoidalHeight(numbers[2])}, angle(3), angle(4), angle(5)};
}

double Camera::pixel_angle() const { return 2.0 * std::tan(vertical_fov.value / 2.0) / height; }

geo::Vector<geo::Ecef> Camera::ray(glm::dvec2 pixel) const {
  const glm::dvec2 offset = (pixel - 0.5 * glm::dvec2(width, height)) * pixel_angle();
  return {glm::normalize(axes[0] * offset.x - axes[1] * offset.y - axes[2])};
}

glm::dmat3 axes_of(const Pose& pose) {
  const double sin_heading = std::sin(pose.heading.value), cos_heading = std::cos(pose.heading.value);
  const double sin_pitch = std::sin(pose.pitch.value), cos_pitch = std::cos(pose.pitch.value);
  const double sin_roll = std::sin(pose.roll.value), cos_roll = std::cos(pose.roll.value);
  const glm::dvec3 forward(cos_pitch * sin_heading, cos_pitch * cos_heading, sin_pitch);
  const glm::dvec3 level_right(cos_heading, -sin_heading, 0.0);
  const glm::dvec3 level_up = glm::cross(level_right, forward);
  const glm::dmat3 axes(level_right * cos_roll - level_up * sin_roll, level_up * cos_roll + level_right * sin_roll,
                        -forward);
  return geo::enu_axes(geo::place_of(pose.position)) * axes;
}

Pose pose_with_axes(const geo::Geodetic& position, const glm::dmat3& axes) {
  const glm::dmat3 local = glm::transpose(geo::enu_axes(geo::place_of(position))) * axes;
  const glm::dvec3& right = local[0];
  const glm::dvec3 forward = -local[2];
  const double level = std::hypot(forward.x, forward.y);
  const Radians pitch(std::atan2(forward.z, level));
  // Straight up or down, heading and roll turn about the same axis: all of it is heading.
  if (level < 1e-12) return {position, Radians(std::atan2(-right.y, right.x)), pitch, Radians(0.0)};
  const glm::dvec3 level_right = glm::dvec3(forward.y, -forward.x, 0.0) / level;
  return {position, Radians(std::atan2(forward.x, forward.y)), pitch,
          Radians(std::atan2(glm::dot(local[1], level_right), glm::dot(right, level_right)))};
}

Camera make_camera(const geo::Ellipsoid& ellipsoid, const Pose& pose, Radians vertical_fov, int width, int height) {
  return {geo::to_ecef(ellipsoid, pose.position), axes_of(pose), vertical_fov, width, height};
}

Pose pose_of(const geo::Ellipsoid& ellipsoid, const Camera& camera) {
  return pose_with_axes(geo::to_geodetic(ellipsoid, camera.eye), camera.axes);
}

Frustum make_frustum(const Camera& camera) {
  const double top = std::tan(camera.vertical_fov.value / 2.0);
  const double side = top * camera.width / camera.height;
  const glm::dvec3 right = camera.axes[0];
  const glm::dvec3 up = camera.axes[1];
  const glm::dvec3 forward = camera.forward().xyz;
  return {{glm::normalize(forward * side + right), glm::normalize(forward * side - right),
           glm::normalize(forward * top + up), glm::normalize(forward * top - up)},
          forward};
}

}  // namespace tellurion::view
