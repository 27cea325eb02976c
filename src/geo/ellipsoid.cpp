#include "geo/ellipsoid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace tellurion::geo {
namespace {

/// Longitude of a direction in (-pi, pi], 0 on the axis. Adding +0 clears the sign of a negative zero.
Radians longitude_of(double x, double y) {
  const double longitude = std::atan2(y + 0.0, x + 0.0);
  return Radians(longitude == -std::numbers::pi ? std::numbers::pi : longitude);
}

/// The ellipsoid's normal through a position, in its meridian's plane: proportional to (cos, sin) of the latitude.
struct NormalDirection {
  double equatorial;
  double axial;
};

/// Vermeille (2011), with his names. `rho` is the distance from the axis. Requires (rho, z) != (0, 0).
NormalDirection normal_direction(const Ellipsoid& ellipsoid, double e2, double rho, double z) {
  if (e2 == 0.0) return {rho, z};
  const double inverse_a = 1.0 / ellipsoid.a();
  const double sqrt_p = rho * inverse_a;
  const double sqrt_q = std::abs(z) * ellipsoid.b() * inverse_a * inverse_a;
  const double p = sqrt_p * sqrt_p;
  const double q = sqrt_q * sqrt_q;
  const double r = (p + q - e2 * e2) / 6.0;
  const double sqrt_s = e2 * sqrt_p * sqrt_q;  // s = e^4 p q
  const double s = sqrt_s * sqrt_s;
  const double outside = 8.0 * r * r * r + s;  // positive outside of the evolute

  double u = 0.0;
  if (outside > 0.0) {
    const double root = std::cbrt(std::sqrt(outside) + sqrt_s);
    const double square = root * root;
    u = r + 0.5 * square + 2.0 * r * r / square;
  } else if (q > 0.0) {
    const double third = 2.0 / 3.0 * std::atan2(sqrt_s, std::sqrt(-outside) + std::sqrt(-8.0 * r * r * r));
    u = -4.0 * r * std::sin(third) * std::cos(std::numbers::pi / 6.0 + third);
  } else {  // in the equator's plane, within the evolute: of two nearest points, the northern one
    const double e = std::sqrt(e2);
    const double root = e * std::sqrt(std::max(0.0, e2 - p));
    const double x = std::sqrt(1.0 - e2) * sqrt_p;
    const double y = std::sqrt(std::max(0.0, e2 * e2 - p));
    // Vermeille gives the half angle: tan(latitude / 2) = y / (root + x).
    const double denominator = root + x;
    return {denominator * denominator - y * y, 2.0 * denominator * y};
  }
  const double v = std::sqrt(u * u + e2 * e2 * q);
  const double w = e2 * (u + v - q) / (2.0 * v);
  const double k = (u + v) / (std::sqrt(w * w + u + v) + w);
  return {k * rho, (k + e2) * z};
}

/// Distance along a ray to the ellipsoid with half axes `a`, `b`; -1 if there is none.
double intersect_axes(double a, double b, const glm::dvec3& eye, const glm::dvec3& direction) {
  const glm::dvec3 inverse_axes(1.0 / a, 1.0 / a, 1.0 / b);
  const glm::dvec3 o = eye * inverse_axes;  // the ellipsoid becomes the unit sphere
  const glm::dvec3 d = direction * inverse_axes;
  const double dd = glm::dot(d, d);
  const double od = glm::dot(o, d);
  // From the point of closest approach: does not cancel for an eye far away.
  const glm::dvec3 closest = o - d * (od / dd);
  const double discriminant = dd * (1.0 - glm::dot(closest, closest));
  if (discriminant < 0.0) return -1.0;
  const double root = std::sqrt(discriminant);
  const double distance = glm::length(o);
  const double c = (distance - 1.0) * (distance + 1.0);
  if (c >= 0.0) return od < 0.0 ? c / (root - od) : -1.0;
  return od > 0.0 ? -c / (od + root) : (root - od) / dd;
}

}  // namespace

Vector<Ecef> normal_at(const LatLon& place) {
  const double cos_lat = std::cos(place.latitude.value);
  return {{cos_lat * std::cos(place.longitude.value), cos_lat * std::sin(place.longitude.value),
           std::sin(place.latitude.value)}};
}

LatLon place_of_normal(const Vector<Ecef>& normal) {
  const glm::dvec3& n = normal.xyz;
  assert(n.x != 0.0 || n.y != 0.0 || n.z != 0.0);
  return {Radians(std::atan2(n.z, std::hypot(n.x, n.y))), longitude_of(n.x, n.y)};
}

Point<Ecef> surface_point(const Ellipsoid& ellipsoid, const Vector<Ecef>& unit_normal) {
  const glm::dvec3& n = unit_normal.xyz;
  const double flat = 1.0 - ellipsoid.e2();  // (b/a)^2
  const double prime_vertical = ellipsoid.a() / std::sqrt(n.x * n.x + n.y * n.y + flat * n.z * n.z);
  return {glm::dvec3(n.x, n.y, flat * n.z) * prime_vertical};
}

Point<Ecef> to_ecef(const Ellipsoid& ellipsoid, const Geodetic& place) {
  assert(std::isfinite(place.latitude.value) && std::isfinite(place.longitude.value) &&
         std::isfinite(place.height.value));
  const Vector<Ecef> up = normal_at(place_of(place));
  return surface_point(ellipsoid, up) + up * place.height.value;
}

Geodetic to_geodetic(const Ellipsoid& ellipsoid, const Point<Ecef>& position) {
  const glm::dvec3& p = position.xyz;
  const double rho = std::sqrt(p.x * p.x + p.y * p.y);
  if (rho == 0.0 && p.z == 0.0) {
    return {Radians(std::numbers::pi / 2.0), Radians(0.0), EllipsoidalHeight(-ellipsoid.b())};
  }
  const double e2 = ellipsoid.e2();
  const NormalDirection n = normal_direction(ellipsoid, e2, rho, p.z);
  const double scale = 1.0 / std::sqrt(n.equatorial * n.equatorial + n.axial * n.axial);
  const double cos_lat = n.equatorial * scale;
  const double sin_lat = n.axial * scale;
  // Distance from the tangent plane: an error of the latitude changes it only in the second order.
  const double height = rho * cos_lat + p.z * sin_lat - ellipsoid.a() * std::sqrt(1.0 - e2 * sin_lat * sin_lat);
  return {Radians(std::atan2(n.axial, n.equatorial)), longitude_of(p.x, p.y), EllipsoidalHeight(height)};
}

glm::dmat3 enu_axes(const LatLon& place) {
  const double sin_lat = std::sin(place.latitude.value);
  const double cos_lat = std::cos(place.latitude.value);
  const double sin_lon = std::sin(place.longitude.value);
  const double cos_lon = std::cos(place.longitude.value);
  return {{-sin_lon, cos_lon, 0.0},
          {-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat},
          {cos_lat * cos_lon, cos_lat * sin_lon, sin_lat}};
}

Transform<Ecef, Enu> enu_at(const Ellipsoid& ellipsoid, const Geodetic& origin) {
  return {enu_axes(place_of(origin)), to_ecef(ellipsoid, origin).xyz};
}

double intersect_ray(const Ellipsoid& ellipsoid, Metres height, const Point<Ecef>& eye, const Vector<Ecef>& direction) {
  double t = intersect_axes(ellipsoid.a() + height.value, ellipsoid.b() + height.value, eye.xyz, direction.xyz);
  if (t < 0.0 || height.value == 0.0 || ellipsoid.a() == ellipsoid.b()) return t;
  // The surface of equal height is no ellipsoid, but nearly the one with the raised axes: a few steps of Newton's
  // method, none where the ray grazes it.
  for (int step = 0; step < 4; ++step) {
    const Geodetic here = to_geodetic(ellipsoid, eye + direction * t);
    const double climb = glm::dot(normal_at(place_of(here)).xyz, direction.xyz);
    const double excess = here.height.value - height.value;
    if (std::abs(climb) < 1e-3 || std::abs(excess) < 4e-15 * ellipsoid.a()) break;
    t -= excess / climb;
  }
  return std::max(t, 0.0);
}

}  // namespace tellurion::geo
