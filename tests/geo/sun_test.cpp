#include "geo/sun.h"

#include <doctest/doctest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "geo/ellipsoid.h"
#include "geo/places.h"

using namespace tellurion;
using namespace tellurion::geo;

namespace {

UtcTime at(const char* text) { return parse_utc(text).value(); }

/// Degrees between a direction and the one above a place given in degrees, east longitude first.
double error_of(const Vector<Ecef>& direction, double lon, double lat) {
  const glm::dvec3 expected = normal_at(place_of(geodetic(lat, lon))).xyz;
  return to_degrees(Radians(std::asin(glm::length(glm::cross(direction.xyz, expected))))).value;
}

double latitude_of(const Vector<Ecef>& direction) { return to_degrees(place_of_normal(direction).latitude).value; }

}  // namespace

TEST_CASE("sun_over_earth, sun_over_moon, sun_over_mars: agree with ERFA 2.0") {
  // East longitude and latitude of the sub-solar point, in degrees. Earth: epv00, ab, pnm06a, gst06a. Moon: the same
  // with moon98; Mars: plan94; both turned by the IAU's rotation elements of 2009. UT1 = UTC.
  struct Expected {
    const char* time;
    double earth[2], moon[2], mars[2];
  };
  const std::vector<Expected> table{
      {"1951-02-11T12:00:00Z", {3.5829, -14.1951}, {121.2252, -0.7372}, {52.3141, -24.9409}},
      {"1969-07-20T20:17:40Z", {-122.8468, 20.5849}, {102.7946, 1.2984}, {-21.8620, -5.7194}},
      {"1987-04-10T00:00:00Z", {-179.6004, 7.6696}, {44.7899, 0.1876}, {2.2812, 1.6937}},
      {"1992-10-13T00:00:00Z", {176.5734, -7.7841}, {-18.7815, -1.4324}, {-45.6614, -8.6006}},
      {"2000-01-01T12:00:00Z", {0.8213, -23.0324}, {-117.8158, 0.6214}, {-38.8122, -25.1134}},
      {"2010-11-03T12:00:00Z", {-4.1084, -15.1140}, {-142.6074, -1.2142}, {-79.6880, 2.1926}},
      {"2024-03-20T03:06:00Z", {135.3547, -0.0000}, {61.1873, -0.4532}, {-45.8286, -15.9189}},
      {"2024-06-20T20:51:00Z", {-132.3037, 23.4382}, {9.3130, 1.5214}, {-125.3043, -24.8966}},
      {"2035-09-05T06:30:00Z", {82.2109, 6.8476}, {145.5487, 0.2262}, {-87.0287, -24.8381}},
      {"2049-12-31T18:00:00Z", {-89.1902, -23.0165}, {91.3631, 1.0306}, {84.3017, 23.0757}},
  };
  for (const Expected& row : table) {
    CAPTURE(row.time);
    CHECK(error_of(sun_over_earth(at(row.time)), row.earth[0], row.earth[1]) < 0.01);
    CHECK(error_of(sun_over_moon(at(row.time)), row.moon[0], row.moon[1]) < 0.02);
    CHECK(error_of(sun_over_mars(at(row.time)), row.mars[0], row.mars[1]) < 0.05);
  }
}

TEST_CASE("sun_over_earth: crosses the equator at the published equinoxes, turns at the solstices") {
  // Times of the U.S. Naval Observatory, to the minute; the declination changes by 0.0003 degrees a minute at an
  // equinox.
  CHECK(std::abs(latitude_of(sun_over_earth(at("2024-03-20T03:06Z")))) < 0.003);
  CHECK(std::abs(latitude_of(sun_over_earth(at("2024-09-22T12:44Z")))) < 0.003);
  CHECK(std::abs(latitude_of(sun_over_earth(at("2000-03-20T07:35Z")))) < 0.003);
  CHECK(latitude_of(sun_over_earth(at("2024-06-20T20:51Z"))) == doctest::Approx(23.438).epsilon(1e-4));
  CHECK(latitude_of(sun_over_earth(at("2024-12-21T09:20Z"))) == doctest::Approx(-23.438).epsilon(1e-4));
}

TEST_CASE("sun_over_mars: agrees with the worked example of Mars24") {
  // 2000-01-06 00:00 UTC: sub-solar longitude 174.72600 W, planetographic declination -25.22838.
  const LatLon place = place_of_normal(sun_over_mars(at("2000-01-06T00:00Z")));
  CHECK(std::abs(to_degrees(place.longitude).value - -174.726) < 0.03);
  // Mars24 makes it planetographic by adding 0.25 sin(Ls), Ls = 277.19.
  CHECK(std::abs(to_degrees(place.latitude).value - (-25.22838 + 0.25 * 0.992)) < 0.001);
}

TEST_CASE("sun_over_moon: agrees with Meeus, example 53.a") {
  // 1992 April 12, 0h: longitude 67.89, latitude 1.46.
  CHECK(error_of(sun_over_moon(at("1992-04-12")), 67.89, 1.46) < 0.03);
}

TEST_CASE("directions to the Sun: have unit length and move smoothly") {
  for (int hour = 0; hour < 2000; ++hour) {
    const UtcTime time = at("2020-01-01") + std::chrono::hours(hour);
    for (const auto sun_over : {sun_over_earth, sun_over_moon, sun_over_mars}) {
      const glm::dvec3 now = sun_over(time).xyz;
      REQUIRE(glm::length(now) == doctest::Approx(1.0).epsilon(1e-14));
      REQUIRE(glm::distance(now, sun_over(time + std::chrono::milliseconds(10)).xyz) < 1e-6);
    }
  }
}

TEST_CASE("direction_to_sun: knows three bodies in any case of letters") {
  const UtcTime time = at("2024-06-20T20:51Z");
  CHECK(direction_to_sun("earth", time) == sun_over_earth(time));
  CHECK(direction_to_sun("Moon", time) == sun_over_moon(time));
  CHECK(direction_to_sun("MARS", time) == sun_over_mars(time));
  CHECK_FALSE(direction_to_sun("Venus", time));
  CHECK_FALSE(direction_to_sun("Vulcan", time));
}
