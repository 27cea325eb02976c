// Rotations of cameras, shared by the motions.
// Thread-safe: pure functions.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace tellurion::view {

inline glm::dmat3 rotation_about(const glm::dvec3& unit_axis, double radians) {
  return glm::mat3_cast(glm::angleAxis(radians, unit_axis));
}

/// Some unit vector at right angles to `v`.
inline glm::dvec3 perpendicular_to(const glm::dvec3& v) {
  const bool along_z = std::abs(v.x) + std::abs(v.y) < 1e-6 * std::abs(v.z);
  return glm::normalize(glm::cross(v, along_z ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0)));
}

/// The smallest rotation that turns the direction of `from` into that of `to`, as axis and angle in [0, pi].
struct Turn {
  glm::dvec3 axis;
  double angle;

  glm::dmat3 part(double fraction) const { return rotation_about(axis, angle * fraction); }
};
inline Turn turn_between(const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 axis = glm::cross(from, to);
  const double sine = glm::length(axis);
  const double cosine = glm::dot(from, to);
  const bool aligned = sine <= 1e-15 * std::abs(cosine);
  return {aligned ? perpendicular_to(from) : axis / sine, std::atan2(sine, cosine)};
}

/// Camera axes without the rounding that many small turns leave in them.
inline glm::dmat3 orthonormal(const glm::dmat3& axes) {
  const glm::dvec3 back = glm::normalize(axes[2]);
  const glm::dvec3 right = glm::normalize(glm::cross(axes[1], back));
  return {right, glm::cross(back, right), back};
}

}  // namespace tellurion::view
