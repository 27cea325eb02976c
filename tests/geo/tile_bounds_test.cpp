#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "geo/ellipsoid.h"
#include "geo/places.h"
#include "geo/tile_key.h"

using namespace tellurion;
using namespace tellurion::geo;

namespace {

/// What a dense grid of points on the tile spans; longitudes unwrapped into [west, west + 2 pi).
struct Span {
  double south = 9.0, north = -9.0, west = 99.0, east = -99.0;
};
Span span_of(const TileKey& key, double from_west, int parts) {
  Span span;
  for (int row = 0; row <= parts; ++row) {
    for (int column = 0; column <= parts; ++column) {
      const glm::dvec3 n = tile_normal(key, glm::dvec2(column, row) / static_cast<double>(parts)).xyz;
      const double latitude = std::atan2(n.z, std::hypot(n.x, n.y));
      span.south = std::min(span.south, latitude);
      span.north = std::max(span.north, latitude);
      if (std::hypot(n.x, n.y) == 0.0) continue;
      double longitude = std::atan2(n.y, n.x);
      if (longitude < from_west - 1e-12) longitude += 2.0 * kPi;
      if (longitude > from_west + 2.0 * kPi - 1e-12) longitude -= 2.0 * kPi;  // the west side, seen from pi
      span.west = std::min(span.west, longitude);
      span.east = std::max(span.east, longitude);
    }
  }
  return span;
}

}  // namespace

TEST_CASE("geodetic_bounds: hold every point of the tile and nothing beyond") {
  for (int level = 0; level <= 4; ++level) {
    const std::uint32_t count = 1u << level;
    for (std::uint8_t face = 0; face < kFaceCount; ++face) {
      for (std::uint32_t y = 0; y < count; ++y) {
        for (std::uint32_t x = 0; x < count; ++x) {
          const TileKey key{face, static_cast<std::uint8_t>(level), x, y};
          CAPTURE(to_string(key));
          const GeodeticBounds bounds = geodetic_bounds(key);
          REQUIRE(bounds.south <= bounds.north);
          REQUIRE(bounds.west <= bounds.east);
          REQUIRE(bounds.west.value >= -kPi);
          REQUIRE(bounds.west.value <= kPi);
          // Extremes lie on corners or on the middle of the face, both of which the grid meets.
          const Span span = span_of(key, bounds.west.value, 32);
          REQUIRE(bounds.south.value == doctest::Approx(span.south).epsilon(1e-14));
          REQUIRE(bounds.north.value == doctest::Approx(span.north).epsilon(1e-14));
          REQUIRE(bounds.south.value <= span.south + 1e-15);
          REQUIRE(bounds.north.value >= span.north - 1e-15);
          REQUIRE(bounds.west.value <= span.west + 1e-15);
          REQUIRE(bounds.east.value >= span.east - 1e-15);
          if (bounds.east.value - bounds.west.value < 2.0 * kPi) {
            REQUIRE(bounds.west.value == doctest::Approx(span.west).epsilon(1e-14));
            REQUIRE(bounds.east.value == doctest::Approx(span.east).epsilon(1e-14));
          }
        }
      }
    }
  }
}

TEST_CASE("geodetic_bounds: a tile with a pole inside or in its corner has all longitudes") {
  const std::uint32_t half = 1u << 9;
  for (const TileKey& key : {TileKey{4, 0, 0, 0}, TileKey{4, 10, half, half}, TileKey{4, 10, half - 1, half}}) {
    const GeodeticBounds bounds = geodetic_bounds(key);
    CHECK(bounds.north.value == kPi / 2.0);
    CHECK(bounds.east.value - bounds.west.value == 2.0 * kPi);
  }
  CHECK(geodetic_bounds({5, 10, half, half}).south.value == -kPi / 2.0);
  const GeodeticBounds beside = geodetic_bounds({4, 10, half + 1, half});
  CHECK(beside.north.value < kPi / 2.0);
  CHECK(beside.east.value - beside.west.value < kPi);
}

TEST_CASE("geodetic_bounds: the antimeridian's face passes pi as a whole and in no smaller tile") {
  const GeodeticBounds whole = geodetic_bounds({2, 0, 0, 0});
  CHECK(whole.west.value == doctest::Approx(0.75 * kPi));
  CHECK(whole.east.value == doctest::Approx(1.25 * kPi));
  const GeodeticBounds west_of_it = geodetic_bounds({2, 1, 0, 0});
  CHECK(west_of_it.east.value == kPi);
  const GeodeticBounds east_of_it = geodetic_bounds({2, 1, 1, 0});
  CHECK(east_of_it.west.value == -kPi);
  CHECK(east_of_it.east.value == doctest::Approx(-0.75 * kPi));
}

TEST_CASE("geodetic_bounds: along an upper edge the extreme latitude is in the middle of the face, in closed form") {
  // The face's upper edge runs at 45 degrees in its middle and falls to atan(sqrt(1/2)) at its corners.
  const GeodeticBounds face = geodetic_bounds({0, 0, 0, 0});
  CHECK(face.north.value == doctest::Approx(kPi / 4.0).epsilon(1e-15));
  CHECK(face.south.value == doctest::Approx(-kPi / 4.0).epsilon(1e-15));
  CHECK(geodetic_bounds({4, 0, 0, 0}).south.value == doctest::Approx(std::atan(std::sqrt(0.5))).epsilon(1e-15));
}

TEST_CASE("geodetic_bounds: the deepest tiles keep their width") {
  const std::uint32_t last = (1u << 28) - 1;
  for (const TileKey& key : {TileKey{0, 28, 5, last}, TileKey{2, 28, last / 2, 77}, TileKey{4, 28, 1000, last}}) {
    const GeodeticBounds bounds = geodetic_bounds(key);
    const double width = (bounds.east.value - bounds.west.value) / tile_angle(28).value;
    const double height = (bounds.north.value - bounds.south.value) / tile_angle(28).value;
    CHECK(width > 0.5);
    CHECK(width < 3.0);
    CHECK(height > 0.3);
    CHECK(height < 2.0);
  }
}
