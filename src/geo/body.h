// Planets and moons that are known by name.
// Thread-safe: pure functions.
// Radii: IAU working group report 2015 (doi:10.1007/s10569-017-9805-5); Earth: WGS 84.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "geo/ellipsoid.h"

namespace tellurion::geo {

struct Body {
  std::string_view name;
  Ellipsoid ellipsoid;  ///< of revolution; bodies of three unequal axes are here as spheres of mean radius
};

/// All known bodies.
std::span<const Body> bodies();

/// The body of this name in any case of letters; nothing if unknown.
std::optional<Body> find_body(std::string_view name);

/// The known body whose equatorial radius is nearest, if it is within a hundredth; null otherwise.
const Body* body_like(const Ellipsoid& ellipsoid);

}  // namespace tellurion::geo
