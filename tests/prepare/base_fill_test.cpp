#include "prepare/base_fill.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include <doctest/doctest.h>

using namespace tellurion::prepare;

namespace {

struct Pair {
  Plane window;
  Plane base;
};

/// A textured base, and the same with other gain and offset.
Pair textured(int width, int height, float gain, float offset) {
  std::mt19937 random(1);
  Pair pair{void_plane(width, height), void_plane(width, height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float value = 100.0F + 40.0F * std::sin(static_cast<float>(x) / 17.0F) + static_cast<float>(random() % 20);
      pair.base.at(x, y) = value;
      pair.window.at(x, y) = gain * value + offset;
    }
  }
  return pair;
}

void cut_hole(Plane& plane, int x, int y, int width, int height) {
  for (int j = y; j < y + height; ++j) {
    for (int i = x; i < x + width; ++i) plane.at(i, j) = std::nanf("");
  }
}

Plane cut(const Plane& plane, int x, int y, int width, int height) {
  Plane part = void_plane(width, height);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) part.at(i, j) = plane.at(x + i, y + j);
  }
  return part;
}

bool same(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

}  // namespace

TEST_CASE("fill_from_base: another gain and offset are found around the void") {
  Pair pair = textured(300, 300, 0.8F, 30.0F);
  const Plane truth = pair.window;
  cut_hole(pair.window, 100, 120, 80, 60);
  const Plane filling = fill_from_base(pair.window, pair.base);
  for (int y = 120; y < 180; ++y) {
    for (int x = 100; x < 180; ++x) CHECK(std::abs(filling.at(x, y) - truth.at(x, y)) < 2.0F);
  }
}

TEST_CASE("fill_from_base: nothing where there are samples, or where the base has none") {
  Pair pair = textured(64, 64, 1.0F, 0.0F);
  cut_hole(pair.window, 10, 10, 20, 20);
  cut_hole(pair.base, 20, 20, 5, 5);
  const Plane filling = fill_from_base(pair.window, pair.base);
  CHECK(std::isnan(filling.at(5, 5)));
  CHECK(std::isnan(filling.at(22, 22)));
  CHECK_FALSE(std::isnan(filling.at(12, 12)));
}

TEST_CASE("fill_from_base: far from all samples it is the base itself") {
  Pair pair = textured(1100, 40, 0.8F, 60.0F);
  cut_hole(pair.window, 40, 0, 1060, 40);
  const Plane filling = fill_from_base(pair.window, pair.base);
  for (int x = 40 + kBaseFillReach; x < 1100; ++x) CHECK(filling.at(x, 20) == pair.base.at(x, 20));
}

TEST_CASE("fill_from_base: windows with the reach around them agree with the whole to the last bit") {
  constexpr int kSide = 1600, kAt = 700, kWanted = 150;
  Pair pair = textured(kSide, kSide, 0.7F, 50.0F);
  const unsigned seed = std::random_device{}();
  MESSAGE("seed " << seed);
  std::mt19937 random(seed);
  for (int i = 0; i < 60; ++i) cut_hole(pair.window, static_cast<int>(random() % (kSide - 300)), static_cast<int>(random() % (kSide - 300)), static_cast<int>(random() % 300), static_cast<int>(random() % 300));
  const Plane whole = fill_from_base(pair.window, pair.base);
  const int left = (kAt - kBaseFillReach) / kBaseFillGrid * kBaseFillGrid, side = kAt + kWanted + kBaseFillReach - left;
  const Plane part = fill_from_base(cut(pair.window, left, left, side, side), cut(pair.base, left, left, side, side));
  bool all = true;
  for (int y = kAt; y < kAt + kWanted; ++y) {
    for (int x = kAt; x < kAt + kWanted; ++x) all = all && same(part.at(x - left, y - left), whole.at(x, y));
  }
  CHECK(all);
}
