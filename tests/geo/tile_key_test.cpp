#include "geo/tile_key.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "geo/ellipsoid.h"
#include "geo/places.h"

using namespace tellurion;
using namespace tellurion::geo;

namespace {

constexpr unsigned kSeed = 271828;
constexpr std::array kSides{Side::north, Side::east, Side::south, Side::west};

/// The two ends of a tile's side in tile coordinates.
std::array<glm::dvec2, 2> ends_of(Side side) {
  switch (side) {
    case Side::north:
      return {glm::dvec2(0.0, 0.0), glm::dvec2(1.0, 0.0)};
    case Side::east:
      return {glm::dvec2(1.0, 0.0), glm::dvec2(1.0, 1.0)};
    case Side::south:
      return {glm::dvec2(0.0, 1.0), glm::dvec2(1.0, 1.0)};
    case Side::west:
      break;
  }
  return {glm::dvec2(0.0, 0.0), glm::dvec2(0.0, 1.0)};
}

glm::dvec3 point_of_side(const TileKey& key, Side side, double along) {
  const auto [first, second] = ends_of(side);
  return tile_normal(key, first + (second - first) * along).xyz;
}

/// All tiles of coarse levels; of deep ones the face's corners, edges and some in the middle.
std::vector<TileKey> sample_tiles(int level) {
  const std::uint32_t count = 1u << level;
  std::set<std::uint32_t> places;
  if (level <= 3) {
    for (std::uint32_t i = 0; i < count; ++i) places.insert(i);
  } else {
    places = {0, 1, count / 3, count / 2 - 1, count / 2, count - 2, count - 1};
  }
  std::vector<TileKey> keys;
  for (std::uint8_t face = 0; face < kFaceCount; ++face) {
    for (const std::uint32_t x : places) {
      for (const std::uint32_t y : places) keys.push_back({face, static_cast<std::uint8_t>(level), x, y});
    }
  }
  return keys;
}

TileKey random_tile(std::mt19937_64& random, int level) {
  const std::uint32_t mask = (1u << level) - 1;
  return {static_cast<std::uint8_t>(random() % kFaceCount), static_cast<std::uint8_t>(level),
          static_cast<std::uint32_t>(random()) & mask, static_cast<std::uint32_t>(random()) & mask};
}

}  // namespace

TEST_CASE("face_normal: faces look where the header says") {
  const auto middle = [](int face) { return face_normal(face, {0.0, 0.0}).xyz; };
  CHECK(middle(0) == glm::dvec3(1.0, 0.0, 0.0));
  CHECK(middle(1) == glm::dvec3(0.0, 1.0, 0.0));
  CHECK(middle(2) == glm::dvec3(-1.0, 0.0, 0.0));
  CHECK(middle(3) == glm::dvec3(0.0, -1.0, 0.0));
  CHECK(middle(4) == glm::dvec3(0.0, 0.0, 1.0));
  CHECK(middle(5) == glm::dvec3(0.0, 0.0, -1.0));
  for (int face = 0; face < 4; ++face) {  // u to the east, v to the south
    const LatLon centre = place_of_normal(face_normal(face, {0.0, 0.0}));
    const LatLon east = place_of_normal(face_normal(face, {0.2, 0.0}));
    CHECK(std::remainder(east.longitude.value - centre.longitude.value, 2.0 * kPi) == doctest::Approx(0.05 * kPi));
    CHECK(place_of_normal(face_normal(face, {0.0, 0.2})).latitude.value == doctest::Approx(-0.05 * kPi));
  }
}

TEST_CASE("face_normal: every face has the same handedness, seen from outside") {
  for (int face = 0; face < kFaceCount; ++face) {
    const glm::dvec3 out = face_normal(face, {0.0, 0.0}).xyz;
    const glm::dvec3 along_u = face_normal(face, {0.1, 0.0}).xyz - out;
    const glm::dvec3 along_v = face_normal(face, {0.0, 0.1}).xyz - out;
    CHECK(glm::dot(glm::cross(along_u, along_v), out) < 0.0);  // rows grow downwards
  }
}

TEST_CASE("neighbour: shares the side to the bit, at every face, side and level") {
  int seams = 0;
  for (const int level : {0, 1, 2, 3, 7, 16, 28}) {
    for (const TileKey& key : sample_tiles(level)) {
      for (const Side side : kSides) {
        const TileKey other = neighbour(key, side);
        REQUIRE(is_valid(other));
        REQUIRE(other != key);
        if (other.face != key.face) ++seams;
        // Exactly one side of the other tile is the same line, in the same or the opposite direction.
        int shared = 0;
        for (const Side back : kSides) {
          bool same = true, reversed = true;
          for (int i = 0; i <= 64; ++i) {
            const glm::dvec3 p = point_of_side(key, side, i / 64.0);
            same = same && p == point_of_side(other, back, i / 64.0);
            reversed = reversed && p == point_of_side(other, back, 1.0 - i / 64.0);
          }
          if (same || reversed) {
            ++shared;
            REQUIRE(neighbour(other, back) == key);
          }
        }
        REQUIRE(shared == 1);
      }
    }
  }
  CHECK(seams > 500);
}

TEST_CASE("neighbour: lies beyond the side") {
  for (const int level : {1, 4, 28}) {
    for (const TileKey& key : sample_tiles(level)) {
      for (const Side side : kSides) {
        const glm::dvec3 middle = point_of_side(key, side, 0.5);
        const glm::dvec3 here = tile_normal(key, {0.5, 0.5}).xyz - middle;
        const glm::dvec3 there = tile_normal(neighbour(key, side), {0.5, 0.5}).xyz - middle;
        REQUIRE(glm::dot(here, there) < 0.0);
      }
    }
  }
}

TEST_CASE("neighbour: going east around the equator comes home after four faces") {
  const TileKey start{0, 5, 3, 15};
  TileKey key = start;
  for (int i = 0; i < 4 * 32; ++i) {
    const double before = place_of_normal(tile_normal(key, {0.5, 0.5})).longitude.value;
    key = neighbour(key, Side::east);
    const double after = place_of_normal(tile_normal(key, {0.5, 0.5})).longitude.value;
    REQUIRE(std::remainder(after - before, 2.0 * kPi) == doctest::Approx(kPi / 64.0));
  }
  CHECK(key == start);
}

TEST_CASE("tile_normal: halves of a tile meet to the bit with its children's") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const TileKey key = random_tile(random, static_cast<int>(random() % kMaxTileLevel));
    const glm::dvec2 st(static_cast<double>(random() % 65) / 64.0, static_cast<double>(random() % 65) / 64.0);
    for (int index = 0; index < 4; ++index) {
      const glm::dvec2 offset(index & 1, index >> 1);
      REQUIRE(tile_normal(key, (st + offset) / 2.0) == tile_normal(child(key, index), st));
    }
  }
}

TEST_CASE("tile_normal: agrees with long double within 1e-15 at any depth") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  using Real = long double;
  for (int i = 0; i < 5000; ++i) {
    const TileKey key = random_tile(random, i % 2 == 0 ? kMaxTileLevel : static_cast<int>(random() % 29));
    const glm::dvec2 st(static_cast<double>(random() % 257) / 256.0, static_cast<double>(random() % 257) / 256.0);
    const Real size = std::ldexp(Real(2), -key.level);
    const Real slope_u = std::tan((size * (key.x + Real(st.x)) - 1) * std::numbers::pi_v<Real> / 4);
    const Real slope_v = std::tan((size * (key.y + Real(st.y)) - 1) * std::numbers::pi_v<Real> / 4);
    const Real length = std::sqrt(1 + slope_u * slope_u + slope_v * slope_v);
    // Components along the face's own axes, which its middle and nearby points give.
    const glm::dvec3 out = face_normal(key.face, {0.0, 0.0}).xyz;
    const glm::dvec3 right = glm::round(face_normal(key.face, {0.99, 0.0}).xyz * 1.4 - out);
    const glm::dvec3 down = glm::round(face_normal(key.face, {0.0, 0.99}).xyz * 1.4 - out);
    const glm::dvec3 normal = tile_normal(key, st).xyz;
    REQUIRE(std::abs(glm::dot(normal, out) - static_cast<double>(1 / length)) < 1e-15);
    REQUIRE(std::abs(glm::dot(normal, right) - static_cast<double>(slope_u / length)) < 1e-15);
    REQUIRE(std::abs(glm::dot(normal, down) - static_cast<double>(slope_v / length)) < 1e-15);
  }
}

TEST_CASE("tile areas: of a level differ by at most 1.42 to 1") {
  double smallest = 1e9, largest = 0.0;
  for (const TileKey& key : sample_tiles(3)) {
    // Finely divided into plane quadrilaterals.
    constexpr int kParts = 16;
    double area = 0.0;
    for (int i = 0; i < kParts * kParts; ++i) {
      const auto corner = [&](int dx, int dy) {
        return tile_normal(key, glm::dvec2(i % kParts + dx, i / kParts + dy) / double{kParts}).xyz;
      };
      area += 0.5 * glm::length(glm::cross(corner(1, 1) - corner(0, 0), corner(0, 1) - corner(1, 0)));
    }
    smallest = std::min(smallest, area);
    largest = std::max(largest, area);
  }
  CHECK(largest / smallest < 1.42);
  CHECK(largest / smallest > 1.2);
}

TEST_CASE("face_point and project_to_face: undo face_normal") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const int face = i % kFaceCount;
    const glm::dvec2 uv(unit(random), unit(random));
    const FacePoint point = face_point(face_normal(face, uv));
    REQUIRE(point.face == face);
    REQUIRE(glm::distance(point.uv, uv) < 1e-15);
    const glm::dvec2 outside = uv * 1.5;
    REQUIRE(glm::distance(project_to_face(face, face_normal(face, outside)).value(), outside) < 1e-14);
  }
}

TEST_CASE("face_point: on an edge or corner, the face of lowest number; in [-1, 1]") {
  CHECK(face_point({{1.0, 1.0, 0.0}}).face == 0);
  CHECK(face_point({{-1.0, 1.0, 0.0}}).face == 1);
  CHECK(face_point({{-1.0, -1.0, -1.0}}).face == 2);
  CHECK(face_point({{0.0, 0.5, 0.5}}).face == 1);
  CHECK(face_point({{1.0, 1.0, 1.0}}).uv == glm::dvec2(1.0, -1.0));
  for (const Geodetic& place : special_places(0.0)) {
    const FacePoint point = face_point(normal_at(place_of(place)));
    REQUIRE(std::abs(point.uv.x) <= 1.0);
    REQUIRE(std::abs(point.uv.y) <= 1.0);
  }
}

TEST_CASE("project_to_face: nothing from 90 degrees away on") {
  CHECK_FALSE(project_to_face(0, {{0.0, 1.0, 0.0}}));
  CHECK_FALSE(project_to_face(0, {{-1.0, 0.1, 0.0}}));
  CHECK(project_to_face(0, {{1e-3, 1.0, 0.0}}));
}

TEST_CASE("tile_at: finds the tile that holds a normal, at every level") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int level = 0; level <= kMaxTileLevel; ++level) {
    for (int i = 0; i < 200; ++i) {
      const TileKey key = random_tile(random, level);
      REQUIRE(tile_at(tile_normal(key, {0.5, 0.5}), level) == key);
      REQUIRE(tile_at(tile_normal(key, {0.1, 0.9}), level) == key);
    }
    for (const Geodetic& place : special_places(0.0)) {
      const TileKey key = tile_at(normal_at(place_of(place)), level);
      REQUIRE(is_valid(key));
      if (level > 0) REQUIRE(parent(key) == tile_at(normal_at(place_of(place)), level - 1));
    }
  }
}

TEST_CASE("face_rect: tiles of a level fill the face") {
  const FaceRect rect = face_rect({0, 2, 1, 3});
  CHECK(rect.lower == glm::dvec2(-0.5, 0.5));
  CHECK(rect.upper == glm::dvec2(0.0, 1.0));
  CHECK(face_rect({0, 28, (1u << 28) - 1, 0}).upper.x == 1.0);
}

TEST_CASE("parent, child, ancestor, contains: fit together") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const TileKey key = random_tile(random, 1 + static_cast<int>(random() % 27));
    CHECK(child(parent(key), child_index(key)) == key);
    for (int index = 0; index < 4; ++index) {
      CHECK(is_valid(child(key, index)));
      CHECK(contains(key, child(key, index)));
      CHECK_FALSE(contains(child(key, index), key));
    }
    CHECK(ancestor(key, key.level) == key);
    CHECK(ancestor(key, 0) == TileKey{key.face, 0, 0, 0});
    CHECK(contains(key, key));
    CHECK_FALSE(contains(key, neighbour(key, Side::east)));
  }
}

TEST_CASE("tile_angle: a quarter turn over the face") {
  CHECK(tile_angle(0).value == kPi / 2.0);
  CHECK(tile_angle(28).value == kPi / 2.0 / (1u << 28));
}

TEST_CASE("to_string and parse_tile_key: are each other's reverse") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  CHECK(to_string(TileKey{4, 3, 7, 0}) == "4/3/7/0");
  for (int i = 0; i < 1000; ++i) {
    const TileKey key = random_tile(random, static_cast<int>(random() % 29));
    CHECK(parse_tile_key(to_string(key)).value() == key);
  }
}

TEST_CASE("parse_tile_key: refuses all else and names it") {
  for (const std::string text : {"",
                                 "/",
                                 "1/2/3",
                                 "1/2/3/0/",
                                 "1/2/3/0/0",
                                 "6/0/0/0",
                                 "0/29/0/0",
                                 "0/1/2/0",
                                 "0/1/0/2",
                                 "-1/0/0/0",
                                 "0/0/0/-0",
                                 "0/0/0/+0",
                                 "00/0/0/0",
                                 "0/01/1/1",
                                 " 0/0/0/0",
                                 "0/0/0/0 ",
                                 "0//0/0",
                                 "256/0/0/0",
                                 "0/256/0/0",
                                 "a/0/0/0",
                                 "0/5/4294967296/0",
                                 "0/5/99999999999999999999/0",
                                 "0.0/0/0/0"}) {
    CAPTURE(text);
    const Result<TileKey> result = parse_tile_key(text);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::invalid_argument);
    CHECK(result.error().message.find("'" + text + "'") != std::string::npos);
  }
}

TEST_CASE("std::hash: spreads the tiles of a level") {
  std::unordered_set<std::size_t> low_bits;
  for (const TileKey& key : sample_tiles(3)) low_bits.insert(std::hash<TileKey>{}(key) % 1024);
  // 384 keys over 1024 places: 320 different ones are expected at random.
  CHECK(low_bits.size() > 280);
}
