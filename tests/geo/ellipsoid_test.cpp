#include "geo/ellipsoid.h"

#include <doctest/doctest.h>
#include <proj.h>

#include <GeographicLib/Geocentric.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "geo/places.h"

using namespace tellurion;
using namespace tellurion::geo;

namespace {

constexpr Ellipsoid kSaturn{Metres(60268000.0), Metres(54364000.0)};  // the flattest planet
constexpr unsigned kSeed = 1729;

/// Distance between the exact position of `place`, in long double, and `position`.
double distance_from_exact(const Ellipsoid& ellipsoid, const Geodetic& place, const Point<Ecef>& position) {
  using Real = long double;
  const Real a = ellipsoid.a(), b = ellipsoid.b();
  const Real lat = place.latitude.value, lon = place.longitude.value, h = place.height.value;
  const Real flat = (b / a) * (b / a);
  const Real n = a / std::sqrt(std::cos(lat) * std::cos(lat) + flat * std::sin(lat) * std::sin(lat));
  const Real x = (n + h) * std::cos(lat) * std::cos(lon) - position.xyz.x;
  const Real y = (n + h) * std::cos(lat) * std::sin(lon) - position.xyz.y;
  const Real z = (n * flat + h) * std::sin(lat) - position.xyz.z;
  return static_cast<double>(std::sqrt(x * x + y * y + z * z));
}

/// The largest errors of both conversions at a place.
void check_conversions(const Ellipsoid& ellipsoid, const Geodetic& place, double tolerance) {
  const Point<Ecef> position = to_ecef(ellipsoid, place);
  REQUIRE(distance_from_exact(ellipsoid, place, position) < tolerance);
  const Geodetic back = to_geodetic(ellipsoid, position);
  REQUIRE(distance_from_exact(ellipsoid, back, position) < tolerance);
  REQUIRE(std::abs(back.height.value - place.height.value) < tolerance);
  REQUIRE(std::abs(back.latitude.value) <= kPi / 2.0);
  REQUIRE(back.longitude.value > -kPi);
  REQUIRE(back.longitude.value <= kPi);
}

double degrees(Radians angle) { return to_degrees(angle).value; }

}  // namespace

TEST_CASE("to_ecef: the pole lies at the polar radius") {
  const Point<Ecef> pole = to_ecef(kWgs84, geodetic(90.0, 0.0));
  CHECK(std::abs(pole.xyz.z - 6356752.314245179) < 1e-8);
  CHECK(std::hypot(pole.xyz.x, pole.xyz.y) < 1e-8);
}

TEST_CASE("to_ecef and to_geodetic: agree with long double within 1e-8 m up to 5000 km on Earth and Mars") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (const Ellipsoid& ellipsoid : {kWgs84, kMars}) {
    const double range = 5e6 * ellipsoid.a() / kWgs84.a();
    for (int i = 0; i < 100000; ++i) check_conversions(ellipsoid, random_place(random, range), 1e-8);
    for (const double height : {-range, -10000.0, -1e-9, 0.0, 1.0, 8848.0, range}) {
      for (const Geodetic& place : special_places(height)) check_conversions(ellipsoid, place, 1e-8);
    }
  }
}

TEST_CASE("to_geodetic: holds down to 6300 km below the Earth's surface, and far out") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    Geodetic place = random_place(random, 1.0);
    place.height = EllipsoidalHeight(-6300e3 + 1300e3 * std::abs(place.height.value));
    check_conversions(kWgs84, place, 1e-8);
    place.height = EllipsoidalHeight(4e8);  // the Moon's distance: as exact as its numbers
    check_conversions(kWgs84, place, 4e-7);
  }
}

TEST_CASE("to_geodetic: holds on spheres and on the flattest planet") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    check_conversions(kMoon, random_place(random, 1.7e6), 1e-8);
    check_conversions(kSaturn, random_place(random, 3e7), 1e-7);
  }
  for (const Geodetic& place : special_places(1000.0)) check_conversions(kMoon, place, 1e-8);
}

TEST_CASE("to_geodetic: agrees with GeographicLib") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (const Ellipsoid& ellipsoid : {kWgs84, kMars, kMoon}) {
    const GeographicLib::Geocentric reference(ellipsoid.a(), 1.0 - ellipsoid.b() / ellipsoid.a());
    for (int i = 0; i < 20000; ++i) {
      const Geodetic place = random_place(random, 1.5e6);
      glm::dvec3 xyz;
      reference.Forward(degrees(place.latitude), degrees(place.longitude), place.height.value, xyz.x, xyz.y, xyz.z);
      REQUIRE(glm::distance(xyz, to_ecef(ellipsoid, place).xyz) < 1e-8);
      double lat = 0.0, lon = 0.0, height = 0.0;
      reference.Reverse(xyz.x, xyz.y, xyz.z, lat, lon, height);
      const Geodetic back = to_geodetic(ellipsoid, {xyz});
      REQUIRE(std::abs(degrees(back.latitude) - lat) < 1e-13);
      REQUIRE(std::abs(degrees(back.longitude) - lon) < 1e-13);
      REQUIRE(std::abs(back.height.value - height) < 1e-8);
    }
  }
}

TEST_CASE("to_geodetic: agrees with GeographicLib within the evolute") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const GeographicLib::Geocentric reference(kWgs84.a(), 1.0 - kWgs84.b() / kWgs84.a());
  for (int i = 0; i < 5000; ++i) {
    const glm::dvec3 xyz = 25e3 * glm::dvec3(unit(random), unit(random), unit(random));
    double lat = 0.0, lon = 0.0, height = 0.0;
    reference.Reverse(xyz.x, xyz.y, xyz.z, lat, lon, height);
    const Geodetic here = to_geodetic(kWgs84, {xyz});
    REQUIRE(std::abs(degrees(here.latitude) - lat) < 1e-6);
    REQUIRE(std::abs(here.height.value - height) < 1e-3);
  }
  for (const double rho : {0.0, 1.0, 100.0, 20000.0, 42000.0}) {  // the equator's plane: the northern of two answers
    double lat = 0.0, lon = 0.0, height = 0.0;
    reference.Reverse(rho, 0.0, 0.0, lat, lon, height);
    const Geodetic here = to_geodetic(kWgs84, {{rho, 0.0, 0.0}});
    CHECK(std::abs(degrees(here.latitude) - lat) < 1e-9);
    CHECK(std::abs(here.height.value - height) < 1e-6);
  }
}

TEST_CASE("to_ecef: agrees with PROJ's geocentric conversion") {
  PJ_CONTEXT* const context = proj_context_create();
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (const Ellipsoid& ellipsoid : {kWgs84, kMars, kMoon}) {
    const std::string definition =
        "+proj=cart +a=" + std::to_string(ellipsoid.a()) + " +b=" + std::to_string(ellipsoid.b());
    PJ* const cart = proj_create(context, definition.c_str());
    REQUIRE(cart != nullptr);
    for (int i = 0; i < 5000; ++i) {
      const Geodetic place = random_place(random, 1e5);
      const PJ_COORD expected =
          proj_trans(cart, PJ_FWD, proj_coord(place.longitude.value, place.latitude.value, place.height.value, 0.0));
      // The definition carries radii to 1e-6 m only.
      REQUIRE(glm::distance(glm::dvec3(expected.xyz.x, expected.xyz.y, expected.xyz.z), to_ecef(ellipsoid, place).xyz) <
              2e-6);
    }
    proj_destroy(cart);
  }
  proj_context_destroy(context);
}

TEST_CASE("to_geodetic: knows the centre, the axis and the antimeridian") {
  for (const Ellipsoid& ellipsoid : {kWgs84, kMoon}) {
    const Geodetic centre = to_geodetic(ellipsoid, {});
    CHECK(centre.latitude.value == kPi / 2.0);
    CHECK(centre.longitude.value == 0.0);
    CHECK(centre.height.value == -ellipsoid.b());
    const Geodetic south = to_geodetic(ellipsoid, {{-0.0, -0.0, -ellipsoid.b() - 10.0}});
    CHECK(south.latitude.value == -kPi / 2.0);
    CHECK(south.longitude.value == 0.0);
    CHECK(std::abs(south.height.value - 10.0) < 1e-8);
    CHECK(to_geodetic(ellipsoid, {{-ellipsoid.a(), -0.0, 0.0}}).longitude.value == kPi);
    CHECK(to_geodetic(ellipsoid, {{-ellipsoid.a(), -1e-300, 0.0}}).longitude.value == kPi);
  }
}

TEST_CASE("to_geodetic: takes less than a microsecond") {
  // Measured at 0.2 us; the bound leaves room for a busy machine and sanitizers.
  Point<Ecef> position = to_ecef(kWgs84, geodetic(46.0, 8.0, 1000.0));
  double best_ns = 1e9;
  double sum = 0.0;
  for (int round = 0; round < 20; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 10000; ++i) {
      position.xyz.x += 0.01;
      sum += to_geodetic(kWgs84, position).latitude.value;
    }
    best_ns = std::min(
        best_ns, std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / 1e4);
  }
  MESSAGE("to_geodetic: " << best_ns << " ns");
  CHECK(sum > 0.0);
  CHECK(best_ns < 1000.0);
}

TEST_CASE("place_of_normal: undoes normal_at, and needs no unit length") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Geodetic place = random_place(random, 0.0);
    const LatLon back = place_of_normal(normal_at(place_of(place)) * 123.0);
    REQUIRE(std::abs(back.latitude.value - place.latitude.value) < 4e-16);
    REQUIRE(std::abs(back.longitude.value - place.longitude.value) < 9e-16);
  }
  CHECK(place_of_normal({{0.0, 0.0, -2.0}}).longitude.value == 0.0);
  CHECK(place_of_normal({{-1.0, -0.0, 0.0}}).longitude.value == kPi);
}

TEST_CASE("surface_point: lies on the ellipsoid, where its gradient is the normal") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Vector<Ecef> normal = normal_at(place_of(random_place(random, 0.0)));
    const glm::dvec3 p = surface_point(kMars, normal).xyz;
    const double a2 = kMars.a() * kMars.a(), b2 = kMars.b() * kMars.b();
    REQUIRE(std::abs((p.x * p.x + p.y * p.y) / a2 + p.z * p.z / b2 - 1.0) < 1e-15);
    const glm::dvec3 gradient(p.x / a2, p.y / a2, p.z / b2);
    REQUIRE(glm::distance(glm::normalize(gradient), normal.xyz) < 1e-15);
  }
}

TEST_CASE("enu_at: axes point east, north and up, at a pole along the given longitude") {
  const Transform<Ecef, Enu> zero = enu_at(kWgs84, geodetic(0.0, 0.0, 5.0));
  CHECK(zero(Vector<Enu>{{1.0, 0.0, 0.0}}) == Vector<Ecef>{{0.0, 1.0, 0.0}});
  CHECK(zero(Vector<Enu>{{0.0, 1.0, 0.0}}) == Vector<Ecef>{{0.0, 0.0, 1.0}});
  CHECK(zero(Point<Enu>{}) == Point<Ecef>{{6378142.0, 0.0, 0.0}});
  const Transform<Ecef, Enu> pole = enu_at(kWgs84, geodetic(90.0, 90.0));
  CHECK(glm::distance(pole(Vector<Enu>{{1.0, 0.0, 0.0}}).xyz, glm::dvec3(-1.0, 0.0, 0.0)) < 1e-15);
  CHECK(glm::distance(pole(Vector<Enu>{{0.0, 0.0, 1.0}}).xyz, glm::dvec3(0.0, 0.0, 1.0)) < 1e-15);
}

TEST_CASE("enu_at: agrees with GeographicLib's local axes, and its inverse comes back") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  const GeographicLib::Geocentric reference(kWgs84.a(), 1.0 - kWgs84.b() / kWgs84.a());
  for (int i = 0; i < 2000; ++i) {
    const Geodetic place = random_place(random, 1e4);
    std::vector<double> m(9);  // row by row: columns are east, north, up
    glm::dvec3 xyz;
    reference.Forward(degrees(place.latitude), degrees(place.longitude), place.height.value, xyz.x, xyz.y, xyz.z, m);
    const Transform<Ecef, Enu> enu = enu_at(kWgs84, place);
    for (int axis = 0; axis < 3; ++axis) {
      const auto column = static_cast<std::size_t>(axis);
      REQUIRE(glm::distance(enu.rotation[axis], glm::dvec3(m[column], m[column + 3], m[column + 6])) < 2e-15);
    }
    const Point<Enu> local{{100.0, -200.0, 300.0}};
    REQUIRE(glm::distance(enu.inverse()(enu(local)).xyz, local.xyz) < 1e-8);
    REQUIRE(glm::distance((enu.inverse() * enu)(local).xyz, local.xyz) < 1e-8);
  }
}

TEST_CASE("intersect_ray: hits the surface of the height, in front, first") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const Ellipsoid& ellipsoid = i % 2 == 0 ? kWgs84 : kMars;
    const Metres height(i % 3 == 0 ? 0.0 : 9000.0 * unit(random));
    Geodetic place = random_place(random, 1.0);
    place.height = EllipsoidalHeight(height.value + std::pow(10.0, 1.0 + 7.0 * std::abs(unit(random))));
    const Point<Ecef> eye = to_ecef(ellipsoid, place);
    const Vector<Ecef> direction{glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)))};
    const double t = intersect_ray(ellipsoid, height, eye, direction);
    if (t < 0.0) continue;
    ++hits;
    const Geodetic hit = to_geodetic(ellipsoid, eye + direction * t);
    const double climb = glm::dot(normal_at(place_of(hit)).xyz, direction.xyz);
    REQUIRE(climb < 0.0);
    if (climb < -1e-2) REQUIRE(std::abs(hit.height.value - height.value) < 1e-6);
    for (const double part : {0.1, 0.5, 0.9}) {
      REQUIRE(to_geodetic(ellipsoid, eye + direction * (part * t)).height.value > height.value - 1e-6);
    }
  }
  CHECK(hits > 2000);
}

TEST_CASE("intersect_ray: a closed form straight down; nothing upwards; from inside the way out") {
  const Point<Ecef> eye{{0.0, 0.0, kWgs84.b() + 1000.0}};
  CHECK(std::abs(intersect_ray(kWgs84, Metres(0.0), eye, {{0.0, 0.0, -1.0}}) - 1000.0) < 1e-8);
  CHECK(std::abs(intersect_ray(kWgs84, Metres(100.0), eye, {{0.0, 0.0, -1.0}}) - 900.0) < 1e-8);
  CHECK(intersect_ray(kWgs84, Metres(0.0), eye, {{0.0, 0.0, 1.0}}) < 0.0);
  CHECK(intersect_ray(kWgs84, Metres(0.0), eye, {{1.0, 0.0, 0.0}}) < 0.0);
  CHECK(std::abs(intersect_ray(kWgs84, Metres(0.0), {}, {{1.0, 0.0, 0.0}}) - kWgs84.a()) < 1e-8);
  CHECK(std::abs(intersect_ray(kWgs84, Metres(2000.0), eye, {{0.0, 0.0, 1.0}}) - 1000.0) < 1e-8);
}
