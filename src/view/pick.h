// What a pixel sees of the ground, and how far the eye is above it.
// Thread-safe as far as the height query is.
#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "geo/height.h"
#include "view/camera.h"

namespace tellurion::view {

/// The planet as a camera's motions see it.
struct Ground {
  geo::Ellipsoid ellipsoid;
  const geo::HeightQuery* heights = nullptr;  ///< none: the bare ellipsoid. Must outlive the uses
};

/// Height of the eye above the ground under it, metres; negative below the ground.
double clearance_of(const Ground& ground, const Camera& camera);

/// The point of the ground that `pixel` sees; nothing if it sees the sky, or if the eye is below the ground.
/// Exact to 1e-9 of the distance; thin peaks of more than 60 degrees of slope may be missed.
std::optional<geo::Point<geo::Ecef>> pick(const Ground& ground, const Camera& camera, glm::dvec2 pixel);

}  // namespace tellurion::view
