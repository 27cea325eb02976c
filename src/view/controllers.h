// How a viewer moves its camera: one function per motion, from a camera to the next.
// Thread-safe: pure functions; they know no mouse and no clock.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "view/camera.h"
#include "view/pick.h"

namespace tellurion::view {

/// Moves around the planet, at the same height and attitude to the horizon, until `grabbed` (a point that the camera
/// sees) appears at `pixel`, as if the ground were pulled there. The camera as it is if the pixel's ray passes beside
/// the planet.
Camera pan(const geo::Ellipsoid& ellipsoid, const Camera& camera, const geo::Point<geo::Ecef>& grabbed,
           glm::dvec2 pixel);

/// Shortens the distance to `target` by a tenth for each step, or lengthens it for negative ones; `target` keeps its
/// pixel.
Camera zoom(const Camera& camera, const geo::Point<geo::Ecef>& target, double steps);

/// Turns around `pivot`, which keeps its pixel and distance: `turn` adds to the heading as seen there, `tilt` to the
/// pitch, which stays within straight down and 5 degrees above the pivot's horizon.
Camera orbit(const geo::Ellipsoid& ellipsoid, const Camera& camera, const geo::Point<geo::Ecef>& pivot, Radians turn,
             Radians tilt);

/// Turns the head: heading and pitch change, the latter within straight down and straight up; roll stays.
Camera look_around(const geo::Ellipsoid& ellipsoid, const Camera& camera, Radians turn, Radians tilt);

/// Levels the horizon and turns to the north, in place.
Camera north_up(const geo::Ellipsoid& ellipsoid, const Camera& camera);

/// Flies for `seconds` along the camera's axes; `motion` is (right, up, forward), each in [-1, 1]. The speed is one
/// clearance per second, at least 2 m/s. Keeps the attitude to the horizon, and the height if the motion is level.
Camera fly(const Ground& ground, const Camera& camera, glm::dvec3 motion, double seconds);

/// Lifts the eye straight up where it is less than `clearance` above the ground.
Camera keep_above(const Ground& ground, const Camera& camera, Metres clearance);

/// The whole planet in the picture, north up, from over latitude 20 of the given longitude.
Camera home(const geo::Ellipsoid& ellipsoid, Radians longitude, Radians vertical_fov, int width, int height);

}  // namespace tellurion::view
