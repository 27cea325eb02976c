#include "view/pick.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <span>

#include "view/motion.h"

using namespace tellurion;
using namespace tellurion::geo;
using namespace tellurion::view;

namespace {

/// Smooth mountains of up to 4,000 m, about 40 km from crest to crest.
class Mountains final : public HeightQuery {
 public:
  void heights(std::span<const LatLon> places, std::span<EllipsoidalHeight> ground) const override {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const glm::dvec3 n = normal_at(places[i]).xyz * 1000.0;
      ground[i] = EllipsoidalHeight(2000.0 + 700.0 * (std::sin(n.x) + std::sin(n.y) + std::sin(n.z)));
    }
  }
};

}  // namespace

TEST_CASE("pick: a point of the ground lies in the pixel that picks it, with nothing before it") {
  const unsigned seed = 5;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const Mountains mountains;
  const Ground ground{kWgs84, &mountains};
  int hits = 0;
  for (int i = 0; i < 1500; ++i) {
    const Camera camera = random_camera(random);
    if (clearance_of(ground, camera) < 1.0) continue;
    const glm::dvec2 pixel = random_pixel(random);
    const auto point = pick(ground, camera, pixel);
    if (!point) continue;
    ++hits;
    REQUIRE(glm::distance(pixel_of(camera, *point), pixel) < 0.001);
    const double distance = glm::distance(point->xyz, camera.eye.xyz);
    const Geodetic place = to_geodetic(kWgs84, *point);
    REQUIRE(std::abs(place.height.value - mountains.height_at(place_of(place)).value) < 1e-6 + 4e-9 * distance);
    for (int part = 1; part < 200; ++part) {
      const Geodetic before = to_geodetic(kWgs84, camera.eye + (*point - camera.eye) * (part / 200.0));
      REQUIRE(before.height.value > mountains.height_at(place_of(before)).value - 1e-3);
    }
  }
  CHECK(hits > 700);
}

TEST_CASE("pick: agrees with the bare ellipsoid's closed form where the ground is level") {
  class Level final : public HeightQuery {
    void heights(std::span<const LatLon>, std::span<EllipsoidalHeight> ground) const override {
      std::ranges::fill(ground, EllipsoidalHeight(0.0));
    }
  };
  const Level level;
  const unsigned seed = 6;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 1000; ++i) {
    const Camera camera = random_camera(random);
    const auto expected = pick({kWgs84}, camera, {640.0, 360.0});
    const auto point = pick({kWgs84, &level}, camera, {640.0, 360.0});
    REQUIRE(expected.has_value() == point.has_value());
    if (point)
      REQUIRE(glm::distance(point->xyz, expected->xyz) < 1e-6 + 1e-8 * glm::distance(point->xyz, camera.eye.xyz));
  }
}

TEST_CASE("pick: the sky and the ground from below give nothing") {
  const Mountains mountains;
  const Ground ground{kWgs84, &mountains};
  CHECK_FALSE(pick(ground, camera_at("46,8,9000,0,30"), {640.0, 360.0}));
  CHECK_FALSE(pick(ground, camera_at("46,8,9000,0,0"), {640.0, 100.0}));
  CHECK_FALSE(pick(ground, camera_at("46,8,-5000,0,-45"), {640.0, 360.0}));
  CHECK_FALSE(pick({kWgs84}, camera_at("46,8,20000000"), {0.0, 0.0}));
}
