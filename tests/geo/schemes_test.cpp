#include "geo/schemes.h"

#include <doctest/doctest.h>
#include <proj.h>

#include <cmath>
#include <random>
#include <string>

#include "geo/places.h"

using namespace tellurion;
using namespace tellurion::geo;

namespace {

constexpr unsigned kSeed = 3857;
constexpr auto kMercator = MapScheme::web_mercator;
constexpr auto kGeographic = MapScheme::geographic;

LatLon at(double lat, double lon) { return place_of(geodetic(lat, lon)); }

}  // namespace

TEST_CASE("map_key_at: finds the well-known tiles of cities") {
  // From the OpenStreetMap wiki, Slippy map tilenames, and the reference implementation of mercantile.
  CHECK(map_key_at(kMercator, at(48.8583, 2.2945), 16) == MapKey{16, 33185, 22545});  // Eiffel Tower
  CHECK(map_key_at(kMercator, at(40.6892, -74.0445), 10) == MapKey{10, 301, 385});    // Statue of Liberty
  CHECK(map_key_at(kGeographic, at(45.0, -90.0), 1) == MapKey{1, 1, 0});
}

TEST_CASE("map_key_at: wraps longitudes and stops at the cut-off") {
  CHECK(map_key_at(kMercator, at(0.1, 180.0), 2) == MapKey{2, 0, 1});
  CHECK(map_key_at(kMercator, at(0.1, 540.0), 2) == MapKey{2, 0, 1});
  CHECK(map_key_at(kMercator, at(0.1, -180.0 - 1e-14), 2).value().x <= 3);
  CHECK_FALSE(map_key_at(kMercator, at(85.06, 0.0), 3));
  CHECK_FALSE(map_key_at(kMercator, at(-90.0, 0.0), 3));
  CHECK(map_key_at(kMercator, {kMercatorLimit, Radians(0.0)}, 3).value().y == 0);
  CHECK(map_key_at(kMercator, {-kMercatorLimit, Radians(0.0)}, 3).value().y == 7);
  CHECK(map_key_at(kGeographic, at(-90.0, 179.9999), 3) == MapKey{3, 15, 7});
  CHECK(map_key_at(kGeographic, at(90.0, 0.0), 30) == MapKey{30, 1u << 30, 0});
}

TEST_CASE("kMercatorLimit: is where the map becomes a square") {
  CHECK(kMercatorLimit.value == doctest::Approx(std::atan(std::sinh(kPi))).epsilon(1e-15));
  CHECK(to_degrees(kMercatorLimit).value == doctest::Approx(85.0511287798).epsilon(1e-12));
}

TEST_CASE("to_map: agrees with PROJ's EPSG:3857") {
  PJ_CONTEXT* const context = proj_context_create();
  PJ* const mercator = proj_create(context, "+proj=webmerc +a=6378137 +b=6378137");
  REQUIRE(mercator != nullptr);
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  constexpr double kHalfSide = kPi * 6378137.0;
  for (int i = 0; i < 10000; ++i) {
    const LatLon place{Radians(1.55 * unit(random)), Radians(kPi * unit(random))};
    const PJ_COORD expected =
        proj_trans(mercator, PJ_FWD, proj_coord(place.longitude.value, place.latitude.value, 0, 0));
    const glm::dvec2 position = to_map(kMercator, place);
    REQUIRE(std::abs((2.0 * position.x - 1.0) * kHalfSide - expected.xy.x) < 1e-7);
    REQUIRE(std::abs((1.0 - 2.0 * position.y) * kHalfSide - expected.xy.y) < 1e-7);
  }
  proj_destroy(mercator);
  proj_context_destroy(context);
}

TEST_CASE("from_map: undoes to_map") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 10000; ++i) {
    const LatLon place{Radians(1.5 * unit(random)), Radians(kPi * unit(random))};
    for (const MapScheme scheme : {kMercator, kGeographic}) {
      const LatLon back = from_map(scheme, to_map(scheme, place));
      REQUIRE(std::abs(back.latitude.value - place.latitude.value) < 2e-15);
      REQUIRE(std::abs(back.longitude.value - place.longitude.value) < 2e-15);
    }
  }
}

TEST_CASE("bounds_of: the root covers the map, children divide their parent") {
  const GeodeticBounds world = bounds_of(kMercator, {0, 0, 0});
  CHECK(world.west.value == -kPi);
  CHECK(world.east.value == kPi);
  CHECK(world.north.value == doctest::Approx(kMercatorLimit.value).epsilon(1e-15));
  CHECK(world.south.value == doctest::Approx(-kMercatorLimit.value).epsilon(1e-15));
  const GeodeticBounds half = bounds_of(kGeographic, {0, 1, 0});
  CHECK(half.west.value == 0.0);
  CHECK(half.east.value == kPi);
  CHECK(half.north.value == kPi / 2.0);
  CHECK(half.south.value == -kPi / 2.0);
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (const MapScheme scheme : {kMercator, kGeographic}) {
    for (int i = 0; i < 1000; ++i) {
      const int level = static_cast<int>(random() % 25);
      const MapKey key{static_cast<std::uint8_t>(level),
                       static_cast<std::uint32_t>(random()) % columns_of(scheme, level),
                       static_cast<std::uint32_t>(random()) % rows_of(scheme, level)};
      const GeodeticBounds bounds = bounds_of(scheme, key);
      const GeodeticBounds north_west = bounds_of(scheme, child(key, 0));
      const GeodeticBounds south_east = bounds_of(scheme, child(key, 3));
      REQUIRE(north_west.north == bounds.north);
      REQUIRE(north_west.west == bounds.west);
      REQUIRE(south_east.south == bounds.south);
      REQUIRE(south_east.east == bounds.east);
      REQUIRE(north_west.south == south_east.north);
      const LatLon middle{(bounds.south + bounds.north) / 2.0, (bounds.west + bounds.east) / 2.0};
      REQUIRE(map_key_at(scheme, middle, level) == key);
      for (int index = 0; index < 4; ++index) REQUIRE(parent(child(key, index)) == key);
    }
  }
}

TEST_CASE("tms_row: turns the rows round and back") {
  CHECK(tms_row({2, 1, 0}) == 3);
  const MapKey key{10, 511, 340};
  CHECK(tms_row({10, 511, tms_row(key)}) == key.y);
}

TEST_CASE("quadkey: agrees with Microsoft's documentation of the Bing Maps tile system") {
  CHECK(quadkey({3, 3, 5}) == "213");
  CHECK(parse_quadkey("213").value() == MapKey{3, 3, 5});
  CHECK(quadkey({0, 0, 0}).empty());
  CHECK(parse_quadkey("").value() == MapKey{});
  CHECK(parse_quadkey(std::string(30, '3')).value() == MapKey{30, (1u << 30) - 1, (1u << 30) - 1});
}

TEST_CASE("parse_quadkey: refuses other digits and too many") {
  for (const std::string& text : {std::string("4"), std::string("01x"), std::string(31, '0'), std::string(" 0")}) {
    const Result<MapKey> result = parse_quadkey(text);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::invalid_argument);
    CHECK(result.error().message.find(text) != std::string::npos);
  }
}
