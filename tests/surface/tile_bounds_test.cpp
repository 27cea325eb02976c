#include "surface/tile_bounds.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include "surface/selection_world.h"

using namespace tellurion;
using namespace tellurion::surface;

namespace {

geo::TileKey random_key(std::mt19937_64& random, int level) {
  std::uniform_int_distribution<std::uint32_t> cell(0, (1u << level) - 1);
  const auto face = static_cast<std::uint8_t>(random() % geo::kFaceCount);
  std::uint32_t x = cell(random);
  std::uint32_t y = cell(random);
  if (random() % 4 == 0) x = 0;  // borders and corners of faces are where the mapping is most skewed
  if (random() % 4 == 0) y = (1u << level) - 1;
  return {face, static_cast<std::uint8_t>(level), x, y};
}

glm::dvec3 surface_at(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key, glm::dvec2 st, double height) {
  const geo::Vector<geo::Ecef> normal = geo::tile_normal(key, st);
  return geo::surface_point(ellipsoid, normal).xyz + height * normal.xyz;
}

const geo::Ellipsoid kBodies[] = {geo::kWgs84, geo::kMars, geo::kMoon,
                                  {Metres(60268000), Metres(54364000)}};  // the last as flat as Saturn

}  // namespace

TEST_CASE("tile_box: encloses the curved surface between its heights") {
  const std::uint64_t seed = 20261;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> unit(0, 1);
  for (const geo::Ellipsoid& body : kBodies) {
    for (int level = 0; level <= geo::kMaxTileLevel; ++level) {
      for (int i = 0; i < 12; ++i) {
        const geo::TileKey key = level == 0 ? geo::TileKey{static_cast<std::uint8_t>(i % 6), 0, 0, 0} : random_key(random, level);
        const double lowest = i % 3 == 0 ? 0 : -1.1e6 * unit(random);
        const double highest = i % 2 == 0 ? lowest : lowest + 2e6 * unit(random);
        const OrientedBox box = tile_box(body, key, lowest, highest);
        double worst = 0;
        for (int sample = 0; sample < 300; ++sample) {
          glm::dvec2 st(unit(random), unit(random));
          if (sample % 3 == 0) st.x = std::round(st.x);
          if (sample % 5 == 0) st.y = std::round(st.y);
          const double height = sample % 2 == 0 ? (sample % 4 == 0 ? lowest : highest) : lowest + (highest - lowest) * unit(random);
          worst = std::max(worst, distance_to(box, surface_at(body, key, st, height)));
        }
        CAPTURE(geo::to_string(key));
        REQUIRE(worst == 0);
      }
    }
  }
}

TEST_CASE("tile_box: is hardly larger than the tile") {
  // Closed form at a face's middle: a square of side a * angle, and the arrow of its half diagonal.
  for (int level = 4; level <= 20; ++level) {
    const std::uint32_t middle = 1u << (level - 1);
    const OrientedBox box = tile_box(geo::kMoon, {0, static_cast<std::uint8_t>(level), middle, middle}, 0, 0);
    const double side = geo::kMoon.a() * geo::tile_angle(level).value;
    CHECK(box.half.x * 2 < side * 1.03);
    CHECK(box.half.y * 2 < side * 1.03);
    CHECK(box.half.z * 2 < side * side / (4 * geo::kMoon.a()) * 1.25 + 1e-6);
  }
}

TEST_CASE("tile_box: a wider range of heights contains a narrower one") {
  const std::uint64_t seed = 7;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 300; ++i) {
    const geo::TileKey key = random_key(random, static_cast<int>(random() % 20));
    const OrientedBox wide = tile_box(geo::kWgs84, key, -1000, 9000);
    const OrientedBox narrow = tile_box(geo::kWgs84, key, -10, 400);
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 sign((corner & 1) * 2 - 1, (corner & 2) - 1, (corner >> 2) * 2 - 1);
      CHECK(distance_to(wide, narrow.centre + narrow.axes * (sign * narrow.half)) < 1e-6);
    }
  }
}

TEST_CASE("tile_shape: sizes agree with arc lengths on a sphere") {
  // Middle of a face: square cells of the level's angle. The corner where three faces meet: a rhombus of 120 degrees whose
  // stretch is sqrt(8/9 * 3/2) of that (closed form of the equi-angular mapping).
  const double r = geo::kMoon.a();
  for (int level = 6; level <= 24; level += 6) {
    const double angle = geo::tile_angle(level).value;
    const std::uint32_t middle = 1u << (level - 1);
    const TileShape square = tile_shape(geo::kMoon, {2, static_cast<std::uint8_t>(level), middle, middle});
    CHECK(square.size == doctest::Approx(r * angle).epsilon(1e-3));
    CHECK(square.grid_diagonal == doctest::Approx(r * angle * std::sqrt(2.0) / (kGridSide - 1)).epsilon(1e-3));
    CHECK(square.cone == doctest::Approx(angle / std::sqrt(2.0)).epsilon(1e-3));
    const TileShape corner = tile_shape(geo::kMoon, {2, static_cast<std::uint8_t>(level), 0, 0});
    CHECK(corner.size == doctest::Approx(r * angle * std::sqrt(4.0 / 3)).epsilon(0.03));
  }
}

TEST_CASE("distance_to: is the distance to the nearest of many points of the box") {
  OrientedBox box;
  box.centre = {10, 0, 0};
  box.half = {1, 2, 3};
  CHECK(distance_to(box, {10.5, 1, -2}) == 0);
  CHECK(distance_to(box, {14, 0, 0}) == doctest::Approx(3));
  CHECK(distance_to(box, {14, 6, 3}) == doctest::Approx(5));
}

TEST_CASE("planes_crossed: keeps every box that holds a point in the picture, and spares planes that it does not cross") {
  const std::uint64_t seed = 99;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> unit(0, 1);
  int dropped = 0;
  for (int i = 0; i < 4000; ++i) {
    const view::Camera camera = testing::random_camera(geo::kWgs84, random, 1000);
    const ViewVolume volume = make_view_volume(camera);
    const geo::TileKey key = random_key(random, static_cast<int>(random() % 7));
    const OrientedBox box = tile_box(geo::kWgs84, key, -500, 5000);
    const auto crossed = planes_crossed(volume, box, kAllPlanes);
    bool holds_point = false;
    for (int sample = 0; sample < 30; ++sample) {
      const glm::dvec3 p = surface_at(geo::kWgs84, key, {unit(random), unit(random)}, -500 + 5500 * unit(random));
      const glm::dvec3 seen = (p - camera.eye.xyz) * camera.axes;  // right, up, back
      const double reach = std::tan(camera.vertical_fov.value / 2);
      const bool inside = seen.z < 0 && std::abs(seen.y) < -seen.z * reach && std::abs(seen.x) < -seen.z * reach * 1280 / 720;
      holds_point = holds_point || inside;
      if (!crossed) continue;
      for (unsigned plane = 0; plane < volume.inward.size(); ++plane) {
        if ((*crossed >> plane & 1u) == 0) CHECK(glm::dot(volume.inward[plane], p - camera.eye.xyz) >= 0);
      }
    }
    if (holds_point) REQUIRE(crossed.has_value());
    dropped += crossed ? 0 : 1;
  }
  CHECK(dropped > 1000);
}

TEST_CASE("Horizon: hides nothing that a straight line reaches past the lowered body") {
  // Brute force: a point of the tile is visible if the segment from the eye stays above the lowest terrain. Geodetic height
  // is the signed distance from a convex body, so it is convex along the segment and a ternary search finds its least value
  // (independent of the scaled-space test).
  const std::uint64_t seed = 4242;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> unit(0, 1);
  int hidden = 0;
  for (int i = 0; i < 6000; ++i) {
    const geo::Ellipsoid& body = kBodies[random() % 3];
    const double lowest = i % 3 == 0 ? 0 : i % 3 == 1 ? -11e3 : -1.1e6 * std::min(1.0, body.b() / 6.4e6);
    const double highest = i % 2 == 0 ? 0 : -lowest * 0.8;
    // A third of the eyes below the ellipsoid.
    const double height = i % 5 == 0 ? lowest * unit(random) : std::exp(unit(random) * 16);
    const geo::Geodetic place{Radians(std::asin(2 * unit(random) - 1)), Radians(6.28 * unit(random)), EllipsoidalHeight(height)};
    const glm::dvec3 eye = geo::to_ecef(body, place).xyz;
    const Horizon horizon(body, eye, lowest);
    const geo::TileKey key = random_key(random, static_cast<int>(random() % 9));
    if (!horizon.hides(tile_box(body, key, lowest, highest))) continue;
    ++hidden;
    for (int sample = 0; sample < 4; ++sample) {
      const glm::dvec3 p = surface_at(body, key, {unit(random), unit(random)}, highest);
      double from = 0;
      double to = 1;
      const auto height_at = [&](double share) { return geo::to_geodetic(body, {glm::mix(eye, p, share)}).height.value; };
      for (int step = 0; step < 80; ++step) {
        const double third = (to - from) / 3;
        if (height_at(from + third) < height_at(to - third)) {
          to -= third;
        } else {
          from += third;
        }
      }
      REQUIRE(height_at(from) < lowest + 1e-3);
    }
  }
  CHECK(hidden > 500);
}

TEST_CASE("Horizon: agrees with the closed form on a sphere") {
  // From height h over a sphere of radius r the horizon lies at the angle acos(r / (r + h)); a point of height k beyond it
  // is seen up to acos(r / (r + k)) further.
  const double r = geo::kMoon.a();
  const double h = 50000;
  const double k = 3000;
  const Horizon horizon(geo::kMoon, {r + h, 0, 0}, 0);
  const double limit = std::acos(r / (r + h)) + std::acos(r / (r + k));
  for (const double offset : {-0.01, -0.001, -1e-5, 1e-5, 0.001, 0.01, 1.0}) {
    const double angle = limit + offset;
    OrientedBox point;
    point.centre = (r + k) * glm::dvec3(std::cos(angle), 0, std::sin(angle));
    CHECK(horizon.hides(point) == (offset > 0));
  }
}
