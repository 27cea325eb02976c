#include "prepare/clouds.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <doctest/doctest.h>

using namespace tellurion::prepare;

namespace {

struct Scene {
  std::vector<Plane> base{3};
  std::vector<Plane> colours{3};
};

/// Three colours of ground, and the same in another tint with round clouds of brightness 230.
Scene cloudy(int width, int height, const std::vector<std::pair<int, int>>& clouds, int radius) {
  std::mt19937 random(2);
  Scene scene;
  for (std::size_t colour = 0; colour < 3; ++colour) {
    scene.base[colour] = void_plane(width, height);
    scene.colours[colour] = void_plane(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float ground = 60.0F + 20.0F * static_cast<float>(colour) + 25.0F * std::sin(static_cast<float>(x + y) / 30.0F) + static_cast<float>(random() % 10);
        scene.base[colour].at(x, y) = ground;
        scene.colours[colour].at(x, y) = 0.9F * ground + 25.0F;
        for (const auto& [left, top] : clouds) {
          if ((x - left) * (x - left) + (y - top) * (y - top) <= radius * radius) scene.colours[colour].at(x, y) = 230.0F;
        }
      }
    }
  }
  return scene;
}

}  // namespace

TEST_CASE("find_clouds: clouds and a rim around them, and not the ground in another tint") {
  constexpr int kSide = 400, kRadius = 25;
  const std::vector<std::pair<int, int>> places{{100, 120}, {250, 300}, {399, 10}};
  const Scene scene = cloudy(kSide, kSide, places, kRadius);
  const auto found = find_clouds(scene.colours, scene.base, 30.0F);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      double nearest = 1e9;
      for (const auto& [left, top] : places) nearest = std::min(nearest, std::hypot(x - left, y - top));
      const bool cloud = found[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)] != 0;
      if (nearest <= kRadius) CHECK(cloud);
      if (nearest > kRadius + 2.0 * kCloudRim) CHECK_FALSE(cloud);
    }
  }
}

TEST_CASE("find_clouds: what is bright in one colour alone is none") {
  Scene scene = cloudy(100, 100, {}, 0);
  for (int x = 40; x < 60; ++x) scene.colours[0].at(x, 50) = 250.0F;
  const auto found = find_clouds(scene.colours, scene.base, 30.0F);
  CHECK(std::count(found.begin(), found.end(), 0) == 100 * 100);
}

TEST_CASE("find_clouds: windows with the reach around them agree with the whole") {
  constexpr int kSide = 900, kAt = 450, kWanted = 120;
  const Scene scene = cloudy(kSide, kSide, {{440, 450}, {520, 560}, {300, 480}, {650, 600}}, 30);
  const auto whole = find_clouds(scene.colours, scene.base, 30.0F);
  const int left = (kAt - kCloudReach) / kBaseFillGrid * kBaseFillGrid, side = kAt + kWanted + kCloudReach - left;
  Scene part;
  const auto cut = [&](const Plane& plane) {
    Plane result = void_plane(side, side);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) result.at(x, y) = plane.at(left + x, left + y);
    }
    return result;
  };
  for (std::size_t colour = 0; colour < 3; ++colour) {
    part.base[colour] = cut(scene.base[colour]);
    part.colours[colour] = cut(scene.colours[colour]);
  }
  const auto found = find_clouds(part.colours, part.base, 30.0F);
  for (int y = kAt; y < kAt + kWanted; ++y) {
    for (int x = kAt; x < kAt + kWanted; ++x) CHECK(found[static_cast<std::size_t>((y - left) * side + x - left)] == whole[static_cast<std::size_t>(y * kSide + x)]);
  }
}
