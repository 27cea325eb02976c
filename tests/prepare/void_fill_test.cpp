#include "prepare/void_fill.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include <doctest/doctest.h>

using namespace tellurion::prepare;

namespace {

double hill(int x, int y) { return 1000.0 + 0.02 * (x - 60) * (x - 60) - 3.0 * y + 0.01 * x * y; }

Plane hills(int width, int height) {
  Plane plane = void_plane(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) plane.at(x, y) = static_cast<float>(hill(x, y));
  }
  return plane;
}

void cut_hole(Plane& plane, int x, int y, int width, int height) {
  for (int j = y; j < y + height; ++j) {
    for (int i = x; i < x + width; ++i) plane.at(i, j) = std::nanf("");
  }
}

Plane cut(const Plane& plane, const PixelBox& box) {
  Plane part = void_plane(box.width, box.height);
  for (int y = 0; y < box.height; ++y) {
    for (int x = 0; x < box.width; ++x) part.at(x, y) = plane.at(box.x + x, box.y + y);
  }
  return part;
}

PixelBox all_of(const Plane& plane) { return {0, 0, plane.width, plane.height}; }

bool same(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

}  // namespace

TEST_CASE("fill_voids: a slope goes on through a void, and samples stay as they are") {
  Plane plane = void_plane(40, 40);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) plane.at(x, y) = static_cast<float>(500 + 7 * x - 3 * y);
  }
  const Plane truth = plane;
  cut_hole(plane, 10, 12, 15, 9);
  fill_voids(plane, all_of(plane), 15);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) CHECK(std::abs(plane.at(x, y) - truth.at(x, y)) < 0.05);
  }
}

TEST_CASE("fill_voids: curved ground is nearer than a membrane's flat lid would be") {
  Plane plane = hills(120, 80);
  cut_hole(plane, 40, 20, 40, 40);
  fill_voids(plane, all_of(plane), 40);
  // Over a parabola of 0.02 x^2 a lid over 40 pixels is off by up to 8.
  for (int y = 20; y < 60; ++y) {
    for (int x = 40; x < 80; ++x) CHECK(std::abs(plane.at(x, y) - hill(x, y)) < 3.0);
  }
}

TEST_CASE("fill_voids: a void that is one pixel too wide or too high stays") {
  for (const auto& [width, height] : {std::pair{11, 4}, {4, 11}}) {
    Plane plane = hills(40, 40);
    cut_hole(plane, 5, 5, width, height);
    cut_hole(plane, 25, 25, 10, 10);
    fill_voids(plane, all_of(plane), 10);
    CHECK(std::isnan(plane.at(5, 5)));
    CHECK(std::isnan(plane.at(4 + width, 4 + height)));
    CHECK_FALSE(std::isnan(plane.at(30, 30)));
  }
}

TEST_CASE("fill_voids: a window with nothing but voids stays so") {
  Plane plane = void_plane(10, 10);
  fill_voids(plane, all_of(plane), 100);
  CHECK(std::isnan(plane.at(5, 5)));
}

TEST_CASE("fill_voids: windows with the margin around them agree with the whole to the last bit") {
  constexpr int kMost = 20, kSide = 150, kStep = 37;
  const unsigned seed = std::random_device{}();
  MESSAGE("seed " << seed);
  std::mt19937 random(seed);
  const auto number = [&random](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
  Plane holed = hills(kSide, kSide);
  for (float& value : holed.values) value += static_cast<float>(number(50));
  for (int i = 0; i < 40; ++i) {
    const int width = 1 + number(12), height = 1 + number(12);
    cut_hole(holed, number(kSide - width), number(kSide - height), width, height);
  }
  Plane whole = holed;
  fill_voids(whole, all_of(whole), kMost);
  constexpr int kMargin = void_fill_margin(kMost);
  for (int y = 0; y < kSide; y += kStep) {
    for (int x = 0; x < kSide; x += kStep) {
      const int left = std::max(x - kMargin, 0), top = std::max(y - kMargin, 0);
      const PixelBox box{left, top, std::min(x + kStep + kMargin, kSide) - left, std::min(y + kStep + kMargin, kSide) - top};
      const PixelBox wanted{x - left, y - top, std::min(kStep, kSide - x), std::min(kStep, kSide - y)};
      Plane window = cut(holed, box);
      fill_voids(window, wanted, kMost);
      for (int j = 0; j < wanted.height; ++j) {
        for (int i = 0; i < wanted.width; ++i) CHECK(same(window.at(wanted.x + i, wanted.y + j), whole.at(x + i, y + j)));
      }
    }
  }
}
