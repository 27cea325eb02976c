// Where a moving eye goes.
#pragma once

#include <chrono>
#include <optional>

#include <glm/vec3.hpp>

#include "geo/ellipsoid.h"
#include "view/camera.h"

namespace tellurion::globe {

class Motion {
 public:
  /// Where the eye will be in a second if it goes on as since the last call, but not much nearer to the ground. Nothing if it
  /// rests, or after a long pause. Call once a frame.
  std::optional<view::Camera> foresee(const geo::Ellipsoid& ellipsoid, const view::Camera& camera, std::chrono::steady_clock::time_point now);

 private:
  glm::dvec3 eye_{0.0};
  std::chrono::steady_clock::time_point time_;
};

}  // namespace tellurion::globe
