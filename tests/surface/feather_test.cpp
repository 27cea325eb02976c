// Distances against a search through all pixels; opacities at places whose distances are known by hand.
#include "surface/feather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "surface/made_world.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

TEST_CASE("distances_to: the nearest of all voids, as a search finds it") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int round = 0; round < 60; ++round) {
    const int width = 1 + static_cast<int>(random() % 40), height = 1 + static_cast<int>(random() % 40);
    const std::uint64_t rarity = 1 + random() % 60;
    std::vector<bool> is_void(static_cast<std::size_t>(width * height));
    for (std::size_t i = 0; i < is_void.size(); ++i) is_void[i] = random() % rarity == 0;
    const std::vector<float> found = distances_to(is_void, width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double nearest = std::numeric_limits<double>::infinity();
        for (int j = 0; j < height; ++j) {
          for (int i = 0; i < width; ++i) {
            if (is_void[static_cast<std::size_t>(j * width + i)]) nearest = std::min(nearest, std::hypot(i - x, j - y));
          }
        }
        const auto here = static_cast<double>(found[static_cast<std::size_t>(y * width + x)]);
        if (std::isinf(nearest)) REQUIRE(std::isinf(here));
        else REQUIRE(here == doctest::Approx(nearest).epsilon(1e-6));
      }
    }
  }
}

TEST_CASE("opacity_at: rises from the border to the feather's end, by the nearer side; where a raster does not end it is 1") {
  const Extent box{{0, 0}, {100, 60}};
  CHECK(opacity_at(box, {50, 30}, 20) == 1.0);
  CHECK(opacity_at(box, {5, 30}, 20) == 0.25);
  CHECK(opacity_at(box, {95, 58}, 20) == 0.1);
  CHECK(opacity_at(box, {10, 55}, 20) == 0.25);
  CHECK(opacity_at(box, {-0.1, 30}, 20) == 0.0);
  CHECK(opacity_at(box, {NAN, 30}, 20) == 0.0);
  CHECK(opacity_at(box, {0.1, 30}, 0) == 1.0);
  CHECK(opacity_at(box, {50, 30}, 1000) == doctest::Approx(0.03));
  const Extent round_the_body{{-INFINITY, -INFINITY}, {INFINITY, INFINITY}};
  CHECK(opacity_at(round_the_body, {-5, 1e6}, 20) == 1.0);
}

TEST_CASE("find_voids: opacity rises from a void's edge, at the level that is read and, for a wide feather, at a coarser one") {
  MadeRaster made;
  made.width = made.height = 2000;
  made.west = 10, made.east = 20, made.south = 40, made.north = 50;
  made.colour = [](int x, int y) {  // a void of 200 x 200 pixels
    return x >= 1000 && x < 1200 && y >= 800 && y < 1000 ? std::array<std::uint8_t, 4>{0, 0, 0, 0} : std::array<std::uint8_t, 4>{255, 255, 255, 255};
  };
  const MadeSource source(made);
  cache::BlockCache blocks(std::size_t{64} << 20);
  auto raster = std::move(cache::CachedRaster::open(source, blocks, 1)).value();
  for (const auto& [feather, tolerance] : {std::pair(10.0, 0.002), std::pair(64.0, 0.002), std::pair(200.0, 0.02), std::pair(900.0, 0.02)}) {
    CAPTURE(feather);
    const VoidDistances voids = std::move(find_voids(raster, 0, {700, 700}, {1300, 1100}, feather)).value();
    REQUIRE_FALSE(voids.pixels.empty());
    CHECK(voids.pixels.size() < 1500u * 1500u);
    for (const double d : {0.5, 3.0, 7.5, 50.0, 150.0, 290.0}) {
      CAPTURE(d);
      // Left of it, above it, and off a corner, where round the edge the nearest pixel's middle counts.
      if (d < 200.0 || feather > 200.0) {
        CHECK(std::abs(voids.opacity_at({1000 - d, 900.5}) - std::min(d / feather, 1.0)) < tolerance);
        if (d < 100.0) CHECK(std::abs(voids.opacity_at({1100.5, 800 - d}) - std::min(d / feather, 1.0)) < tolerance);
        const double off_corner = std::hypot(d + 0.5, d + 0.5) - 0.5;
        if (d < 100.0) CHECK(std::abs(voids.opacity_at({1000 - d, 800 - d}) - std::min(off_corner / feather, 1.0)) < std::max(tolerance, 0.5 / feather));
      }
    }
    CHECK(voids.opacity_at({1100, 900}) == 0.0);
  }
  CHECK(std::move(find_voids(raster, 0, {100, 100}, {600, 500}, 50.0)).value().pixels.empty());   // none near
  CHECK(std::move(find_voids(raster, 0, {700, 700}, {1300, 1100}, 0.3)).value().pixels.empty());  // less than interpolation makes of it
}
