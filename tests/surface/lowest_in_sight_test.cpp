#include "surface/lowest_in_sight.h"

#include <cmath>
#include <random>
#include <unordered_map>

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include "surface/selection_world.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

constexpr int kPatchLevel = 6;

/// Ground at a depth of its own under each tile of kPatchLevel: shallow in most places.
struct PatchedPlanet : SurfaceFacts {
  float min_height(const geo::TileKey& key) const {
    if (key.level > kPatchLevel) return min_height(geo::ancestor(key, kPatchLevel));
    float& height = known_.try_emplace(geo::to_string(key), 1.0f).first->second;
    if (height != 1.0f) return height;
    if (key.level == kPatchLevel) {
      std::mt19937 random(key.face * 10007u + key.x * 131u + key.y);
      const double unit = std::uniform_real_distribution<>()(random);
      return height = static_cast<float>(-9000 * std::pow(unit, 8));
    }
    float lowest = 0;
    for (int i = 0; i < 4; ++i) lowest = std::min(lowest, min_height(geo::child(key, i)));
    return known_[geo::to_string(key)] = lowest;
  }

  TileFacts facts_of(const geo::TileKey& key) const override {
    TileFacts facts;
    facts.min_height = min_height(key);
    facts.max_height = facts.min_height + 500;
    facts.height_error = HeightError{1, 1};
    return facts;
  }

 private:
  mutable std::unordered_map<std::string, float> known_;
};

}  // namespace

TEST_CASE("lowest_in_sight: a line of sight that meets the lowered ellipsoid has met the ground before") {
  const std::uint64_t seed = 19;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> unit(0, 1);
  const geo::Ellipsoid& body = geo::kWgs84;
  const auto planet = std::make_shared<PatchedPlanet>();
  int met = 0, raised = 0;
  for (int i = 0; i < 300; ++i) {
    NodePool pool(body, planet);
    SelectionSettings settings;
    settings.exaggeration = i % 4 == 0 ? 10 : 1;
    const view::Camera camera = random_camera(body, random, 200);
    const SelectionFrame frame = make_frame(pool, camera, settings, 1, 0, {});
    const double lowest = lowest_in_sight(pool, frame);
    REQUIRE(lowest <= 0);
    REQUIRE(lowest >= frame.lowest);
    raised += lowest > 0.5 * frame.lowest;
    // Where lines meet it, in the space where it is the unit sphere.
    const double shrunk = 1 + lowest / body.b();
    const glm::dvec3 radii = shrunk * glm::dvec3(body.a(), body.a(), body.b());
    const glm::dvec3 eye = camera.eye.xyz / radii;
    for (int point = 0; point < 100; ++point) {
      const glm::dvec3 ray = camera.ray({1280 * unit(random), 720 * unit(random)}).xyz;
      const glm::dvec3 along = ray / radii;
      const double half = glm::dot(eye, along), square = glm::dot(along, along), outside = glm::dot(eye, eye) - 1;
      const double root = half * half - square * outside;
      if (outside <= 0 || half >= 0 || root < 0) continue;
      const double distance = (-half - std::sqrt(root)) / square;
      bool has_met = false;
      for (int step = 100; step > 0 && !has_met; --step) {
        const geo::Geodetic place = geo::to_geodetic(body, {camera.eye.xyz + ray * (distance * step / 100)});
        const geo::TileKey patch = geo::tile_at(geo::normal_at(geo::place_of(place)), kPatchLevel);
        has_met = place.height.value <= static_cast<double>(planet->min_height(patch)) * settings.exaggeration + 1e-3;
      }
      REQUIRE(has_met);
      ++met;
    }
  }
  CHECK(met > 5000);
  CHECK(raised > 50);
}

TEST_CASE("lowest_in_sight: is that of the ground near by, whatever lies on the other side of the planet") {
  EvenPlanet planet;
  NodePool pool(planet.ellipsoid, std::make_shared<EvenPlanet>(planet));
  const SelectionFrame frame = make_frame(pool, camera_at(planet.ellipsoid, 40, 50, 5500, 0, -15), {}, 1, 0, {});
  CHECK(frame.lowest == doctest::Approx(-4000));
  CHECK(lowest_in_sight(pool, frame) == doctest::Approx(-4000.0 / 8));  // as facts say of tiles of level 6
}

TEST_CASE("lowest_in_sight: an eye below the ground sees as far as there is ground") {
  EvenPlanet planet;
  NodePool pool(planet.ellipsoid, std::make_shared<EvenPlanet>(planet));
  const SelectionFrame frame = make_frame(pool, camera_at(planet.ellipsoid, 40, 50, -4500, 0, -15), {}, 1, 0, {});
  CHECK(lowest_in_sight(pool, frame) == frame.lowest);
}
