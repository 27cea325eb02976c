#include "globe/motion.h"

#include <cmath>

#include <glm/geometric.hpp>

namespace tellurion::globe {

std::optional<view::Camera> Motion::foresee(const geo::Ellipsoid& ellipsoid, const view::Camera& camera, std::chrono::steady_clock::time_point now) {
  constexpr double kAhead = 1.0;          // seconds
  constexpr double kLongestFrame = 0.25;  // after a longer pause it is another motion
  constexpr double kLeastStep = 1e-4;     // of the height, in the time ahead
  const double elapsed = std::chrono::duration<double>(now - time_).count();
  const glm::dvec3 step = camera.eye.xyz - eye_;
  eye_ = camera.eye.xyz;
  time_ = now;
  if (!(elapsed > 0.0 && elapsed < kLongestFrame)) return std::nullopt;
  const double height = geo::to_geodetic(ellipsoid, camera.eye).height.value;
  glm::dvec3 way = step * (kAhead / elapsed);
  if (glm::length(way) < kLeastStep * std::abs(height)) return std::nullopt;
  view::Camera later = camera;
  for (int i = 0; i < 4; ++i, way *= 0.5) {
    later.eye.xyz = eye_ + way;
    if (geo::to_geodetic(ellipsoid, later.eye).height.value > 0.5 * height) return later;
  }
  return std::nullopt;
}

}  // namespace tellurion::globe
