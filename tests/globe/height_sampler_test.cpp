// Heights at once: from what is in memory, better with every question, the sampler's own in the end.
#include <array>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "globe/globe.h"
#include "source/made_raster.h"
#include "surface/global_heights.h"

using namespace tellurion;
using namespace tellurion::globe;
using tellurion::test::MadeFile;
using tellurion::test::MadeRaster;

namespace {

constexpr std::chrono::seconds kPatience{60};

/// The whole Earth by half degrees, and ten degrees of it finer and 1,000 m higher.
struct Files {
  static std::vector<double> slope(int width, int height, double base) {
    std::vector<double> values;
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) values.push_back(base + std::round(500.0 * std::cos(6.28318530718 * column / width)) + row % 7);
    }
    return values;
  }
  MadeFile coarse{"coarse.tif", MadeRaster{.width = 720, .height = 360, .values = {slope(720, 360, 2000)}, .type = GDT_Int16, .transform = std::array<double, 6>{-180, 0.5, 0, 90, 0, -0.5}}};
  MadeFile fine{"fine.tif", MadeRaster{.width = 2000, .height = 2000, .values = {slope(2000, 2000, 3000)}, .type = GDT_Int16, .transform = std::array<double, 6>{10, 0.005, 0, 50, 0, -0.005}}};
};

std::unique_ptr<Globe> open(const Files& files, int workers) {
  World world;
  for (const MadeFile* file : {&files.coarse, &files.fine}) {
    LayerSpec layer;
    layer.group = LayerGroup::height;
    layer.source.path = file->path();
    layer.source.vertical = "ellipsoid";
    world.layers.push_back(layer);
  }
  GlobeOptions options;
  options.workers = workers;
  return std::move(*Globe::open(world, options));
}

geo::LatLon at(double latitude, double longitude) { return {to_radians(Degrees(latitude)), to_radians(Degrees(longitude))}; }

/// Lets workers, or this thread, go on.
void go_on(Globe& globe) {
  if (!globe.run_one()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace

TEST_CASE("height_now answers at once, better with every question, and in the end as height_at") {
  const Files files;
  for (const int workers : {0, 2}) {
    CAPTURE(workers);
    const auto globe = open(files, workers);
    auto sampler = std::move(*globe->height_sampler());
    const geo::LatLon place = at(45.1234, 15.4321), other = at(-30.0, -100.0);
    if (workers == 0) {  // nothing has been read, and nobody reads
      CHECK(sampler.height_now(place).level == -1.0);
      CHECK_FALSE(sampler.height_now(place).is_final);
      CHECK(globe->memory_cache_bytes() == 0);
    }
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    double level = -1.0;
    for (;;) {
      const auto now = sampler.height_now(place);
      CHECK(now.level >= level);
      level = now.level;
      if (level >= 0.0) CHECK(now.height.value > 1400.0);  // never a zero that stands for nothing
      if (now.is_final) break;
      REQUIRE(std::chrono::steady_clock::now() < deadline);
      go_on(*globe);
    }
    auto exact = std::move(*globe->height_sampler());
    for (const double spacing : {0.0, 2000.0, 30000.0, 200000.0}) {
      while (!sampler.height_now(place, Metres(spacing)).is_final) {
        REQUIRE(std::chrono::steady_clock::now() < deadline);
        go_on(*globe);
      }
      const auto now = sampler.height_now(place, Metres(spacing));
      const auto known = exact.height_at(place, HeightLookup::bilinear, Metres(spacing));
      CHECK(now.height.value == known->height.value);
      CHECK(now.level == known->level);
    }
    // Elsewhere the coarse samples, or the grid of the whole body, are there already.
    while (!globe->resident_heights()) {
      REQUIRE(std::chrono::steady_clock::now() < deadline);
      go_on(*globe);
    }
    const auto elsewhere = sampler.height_now(other);
    CHECK(elsewhere.level > 0.0);
    CHECK(std::abs(elsewhere.height.value - exact.height_at(other)->height.value) < 30.0);
  }
}

TEST_CASE("resident_heights follows the layers") {
  const Files files;
  const auto globe = open(files, 2);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  const auto settles_at = [&](double metres) {
    for (;;) {
      const auto global = globe->resident_heights();
      if (global && std::abs(global->at(at(45.0, 15.0)) - metres) < 30.0) return true;
      if (std::chrono::steady_clock::now() >= deadline) return false;
      go_on(*globe);
    }
  };
  auto sampler = std::move(*globe->height_sampler());
  CHECK(settles_at(sampler.height_at(at(45.0, 15.0), HeightLookup::bilinear, Metres(78000.0))->height.value));
  LayerSettings off = globe->layer_settings(1);
  off.enabled = false;
  REQUIRE(globe->set_layer(1, off).has_value());
  auto below = std::move(*globe->height_sampler());
  const double lower = below.height_at(at(45.0, 15.0))->height.value;
  CHECK(lower < 2600.0);
  CHECK(settles_at(lower));
}
