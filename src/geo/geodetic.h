// Positions by angles and height.
#pragma once

#include "base/quantity.h"

namespace tellurion::geo {

/// A direction of the ellipsoid's normal by angles: a place without a height.
struct LatLon {
  Radians latitude;   ///< geodetic, [-pi/2, pi/2], north positive
  Radians longitude;  ///< any value; wrapped where it matters
};

/// A position by angles and height above the ellipsoid (not above sea level).
struct Geodetic {
  Radians latitude;          ///< geodetic, [-pi/2, pi/2], north positive
  Radians longitude;         ///< any value; wrapped where it matters
  EllipsoidalHeight height;  ///< metres
};

constexpr LatLon place_of(const Geodetic& g) { return {g.latitude, g.longitude}; }

}  // namespace tellurion::geo
