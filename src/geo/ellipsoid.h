// An ellipsoid of revolution and the conversions between geodetic and body-centred positions.
// Thread-safe: pure functions, no state.
// Reverse method: Vermeille (2002), doi:10.1007/s00190-002-0273-6, extended by Vermeille (2011),
// doi:10.1007/s00190-010-0419-x.
#pragma once

#include "geo/frames.h"
#include "geo/geodetic.h"

namespace tellurion::geo {

/// An oblate or spherical body: equatorial radius `a` >= polar radius `b` > 0.
struct Ellipsoid {
  Metres equatorial_radius{6378137.0};
  Metres polar_radius{6356752.314245179};

  friend constexpr bool operator==(const Ellipsoid&, const Ellipsoid&) = default;

  constexpr double a() const { return equatorial_radius.value; }
  constexpr double b() const { return polar_radius.value; }
  /// First eccentricity squared, (a^2 - b^2) / a^2.
  constexpr double e2() const { return (a() - b()) * (a() + b()) / (a() * a()); }
};

/// WGS 84 (NIMA TR8350.2), the Moon and Mars (IAU 2015 report, doi:10.1007/s10569-017-9805-5).
inline constexpr Ellipsoid kWgs84{Metres(6378137.0), Metres(6356752.314245179)};
inline constexpr Ellipsoid kMoon{Metres(1737400.0), Metres(1737400.0)};
inline constexpr Ellipsoid kMars{Metres(3396190.0), Metres(3376200.0)};

/// Unit normal of the ellipsoid at `place` (the n-vector). The same on every ellipsoid.
Vector<Ecef> normal_at(const LatLon& place);

/// Latitude and longitude of a normal (need not have unit length; must not be zero). Longitude in (-pi, pi], 0 at the
/// poles.
LatLon place_of_normal(const Vector<Ecef>& normal);

/// The point of the ellipsoid's surface where the outward normal is `unit_normal`.
Point<Ecef> surface_point(const Ellipsoid& ellipsoid, const Vector<Ecef>& unit_normal);

/// Position of `place`. Error below 1e-8 m for heights within +-5000 km on Earth. Requires finite input (asserted).
Point<Ecef> to_ecef(const Ellipsoid& ellipsoid, const Geodetic& place);

/// The reverse of to_ecef. Error below 1e-8 m outside the evolute (everywhere above -6,300 km on Earth).
/// Inside it, the nearest surface point's angles with the longest downward normal; at the centre: lat 90, lon 0.
Geodetic to_geodetic(const Ellipsoid& ellipsoid, const Point<Ecef>& position);

/// East, north and up at `place` as columns, unit vectors in ECEF. At a pole, east is that of the given longitude.
glm::dmat3 enu_axes(const LatLon& place);

/// East, north and up at `origin`, as a rigid motion to ECEF. At a pole, east is that of the given longitude.
Transform<Ecef, Enu> enu_at(const Ellipsoid& ellipsoid, const Geodetic& origin);

/// Distance from `eye` along the unit `direction` to the ellipsoid raised by `height`; negative if the ray misses
/// it or it lies behind the eye. From inside, the way out. Exact to 1e-6 m of height unless the ray grazes the surface.
double intersect_ray(const Ellipsoid& ellipsoid, Metres height, const Point<Ecef>& eye, const Vector<Ecef>& direction);

}  // namespace tellurion::geo
