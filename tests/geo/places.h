// Places for tests: random ones, and the ones where formulas break.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "geo/ellipsoid.h"
#include "geo/geodetic.h"

namespace tellurion::geo {

inline constexpr double kPi = std::numbers::pi;

inline Geodetic geodetic(double lat_degrees, double lon_degrees, double height = 0.0) {
  return {to_radians(Degrees(lat_degrees)), to_radians(Degrees(lon_degrees)), EllipsoidalHeight(height)};
}

/// Evenly over the sphere, heights within +-`height_range`.
inline Geodetic random_place(std::mt19937_64& random, double height_range) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  return {Radians(std::asin(unit(random))), Radians(kPi * unit(random)),
          EllipsoidalHeight(height_range * unit(random))};
}

/// Poles, equator, antimeridian, corners of the cube, and a hair beside each.
inline std::vector<Geodetic> special_places(double height) {
  std::vector<Geodetic> places;
  const double corner = to_degrees(Radians(std::atan(std::sqrt(0.5)))).value;
  for (const double lat : {-90.0, -corner, -45.0, 0.0, corner, 45.0, 90.0}) {
    for (const double lon : {-180.0, -135.0, -90.0, -45.0, 0.0, 45.0, 90.0, 135.0, 180.0}) {
      for (const double nudge : {0.0, 1e-12, 1e-9, 1e-5}) {
        const double inner_lat = lat > 0.0 ? lat - nudge : lat + nudge;
        places.push_back(geodetic(inner_lat, lon + nudge, height));
        places.push_back(geodetic(inner_lat, lon - nudge, height));
      }
    }
  }
  return places;
}

}  // namespace tellurion::geo
