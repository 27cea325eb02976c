#include "surface/elevation_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <gdal_priv.h>
#include <glm/geometric.hpp>

#include "source/gdal/gdal_source.h"
#include "surface/made_world.h"
#include "surface/tile_grid.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

double height(MadeWorld& world, double latitude, double longitude, Lookup lookup = Lookup::bilinear, double spacing = 0) {
  return world.model->height_at(at(latitude, longitude), lookup, spacing)->metres;
}

/// A regional raster over 10..20 E, 40..50 N with a sample every 0.1 degrees.
MadeRaster region(std::function<float(int, int)> metres) {
  MadeRaster raster;
  raster.width = raster.height = 100;
  raster.west = 10, raster.east = 20, raster.south = 40, raster.north = 50;
  raster.metres = std::move(metres);
  return raster;
}

MadeRaster globe(float metres) {
  MadeRaster raster;
  raster.metres = [metres](int, int) { return metres; };
  return raster;
}

}  // namespace

TEST_CASE("height_at: agrees with GDAL's own bilinear value of the finest raster to 1 mm") {
  const std::string path = std::string(TELLURION_SHARED_DATA_DIR) + "/earth/elevation/etopo5.tif";
  if (!std::filesystem::exists(path)) return;
  auto opened = source::open_gdal({.path = path}, geo::kWgs84);
  REQUIRE(opened);
  auto description = std::make_shared<SurfaceDescription>();
  description->heights.emplace_back();
  description->heights.back().source = std::move(*opened);
  cache::BlockCache blocks(std::size_t{64} << 20);
  ElevationModel model = std::move(ElevationModel::open(description, blocks)).value();

  const GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str()));
  REQUIRE(dataset);
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> latitude(-89, 89), longitude(-179, 179);
  for (int i = 0; i < 300; ++i) {
    const double lat = latitude(random), lon = longitude(random);
    const double x = (lon + 180 + 1.0 / 24) * 12, y = (90 + 1.0 / 24 - lat) * 12;
    // The samples round the place as floats (GDAL rounds its results to the raster's type), resampled by GDAL.
    const int left = static_cast<int>(x) - 2, top = static_cast<int>(y) - 2;
    std::array<double, 25> around{};
    REQUIRE(dataset->GetRasterBand(1)->RasterIO(GF_Read, left, top, 5, 5, around.data(), 5, 5, GDT_Float64, 0, 0, nullptr) == CE_None);
    const GDALDatasetUniquePtr floats(GetGDALDriverManager()->GetDriverByName("MEM")->Create("", 5, 5, 1, GDT_Float64, nullptr));
    REQUIRE(floats->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 5, 5, around.data(), 5, 5, GDT_Float64, 0, 0, nullptr) == CE_None);
    GDALRasterIOExtraArg extra;
    INIT_RASTERIO_EXTRA_ARG(extra);
    extra.eResampleAlg = GRIORA_Bilinear;
    extra.bFloatingPointWindowValidity = TRUE;
    extra.dfXOff = x - left - 0.5, extra.dfYOff = y - top - 0.5, extra.dfXSize = 1, extra.dfYSize = 1;
    std::array<double, 9> enlarged{};  // as large as the window, GDAL would not resample
    REQUIRE(floats->GetRasterBand(1)->RasterIO(GF_Read, 1, 1, 1, 1, enlarged.data(), 3, 3, GDT_Float64, 0, 0, &extra) == CE_None);
    const double theirs = enlarged[4];
    CAPTURE(lat);
    CAPTURE(lon);
    REQUIRE(std::abs(model.height_at(at(lat, lon), Lookup::bilinear)->metres - theirs) < 0.001);
  }
}

TEST_CASE("height_at: a layer replaces what lies below, or adds to it, within its bounds only") {
  Layer upper = layer_of(region([](int, int) { return 700.0f; }), 2);
  MadeWorld replaced({layer_of(globe(100), 1), upper});
  CHECK(height(replaced, 45, 15) == 700);
  CHECK(height(replaced, 45, 5) == 100);
  upper.adds = true;
  MadeWorld added({layer_of(globe(100), 1), upper});
  CHECK(height(added, 45, 15) == 800);
  CHECK(height(added, -45, 15) == 100);
  upper.enabled = false;
  MadeWorld disabled({layer_of(globe(100), 1), upper});
  CHECK(height(disabled, 45, 15) == 100);
  CHECK(height(*std::make_unique<MadeWorld>(std::vector<Layer>{}), 45, 15) == 0);
}

TEST_CASE("height_at: falls to the layer below across one sample beyond a border, without a step") {
  MadeWorld world({layer_of(globe(100), 1), layer_of(region([](int, int) { return 700.0f; }), 2)});
  CHECK(height(world, 45, 20) == doctest::Approx(700));
  CHECK(height(world, 45, 20.05) == doctest::Approx(400));
  CHECK(height(world, 45, 20.1) == doctest::Approx(100));
  CHECK(height(world, 50.05, 20.05) == doctest::Approx(250));
}

TEST_CASE("height_at: with a feather a layer rises from the one below over so many samples, voids are filled as ever") {
  const auto pit = [](int x, int y) { return std::abs(x - 5) < 2 && std::abs(y - 50) < 2 ? NAN : 700.0f; };
  Layer upper = layer_of(region(pit), 2);
  upper.feather = 20;  // 2 degrees
  MadeWorld world({layer_of(globe(100), 1), upper});
  CHECK(height(world, 45, 20.05) == doctest::Approx(100));
  CHECK(height(world, 45, 20) == doctest::Approx(100));
  CHECK(height(world, 45, 19.5) == doctest::Approx(250));
  CHECK(height(world, 45, 19.5, Lookup::bilinear, 30e3) == doctest::Approx(250));  // at coarser levels too
  CHECK(height(world, 45, 19.05, Lookup::nearest) == doctest::Approx(385));
  CHECK(height(world, 49, 19.5) == doctest::Approx(250));
  CHECK(height(world, 45, 18) == doctest::Approx(700));
  CHECK(height(world, 45, 15) == doctest::Approx(700));
  CHECK(height(world, 44.95, 10.55) == doctest::Approx(100 + 600 * 0.55 / 2));  // in the pit
  upper.adds = true;
  MadeWorld added({layer_of(globe(100), 1), upper});
  CHECK(height(added, 45, 19.5) == doctest::Approx(275));
  CHECK(height(added, 45, 15) == doctest::Approx(800));
}

TEST_CASE("height_at: a void shows the layer's own surroundings where they are finer than the layer below") {
  const auto pit = [](int x, int y) { return std::abs(x - 50) < 3 && std::abs(y - 50) < 3 ? NAN : 2000.0f + static_cast<float>(x); };
  MadeWorld over_coarse({layer_of(globe(100), 1), layer_of(region(pit), 2)});
  const auto answer = over_coarse.model->height_at(at(44.95, 15.05), Lookup::bilinear);
  CHECK(answer->metres == doctest::Approx(2050).epsilon(0.01));
  const double spacing = over_coarse.description->heights[1].source->description().spacing.value;
  CHECK(answer->spacing > 1.5 * spacing);  // a coarser level answered
  CHECK(answer->spacing < over_coarse.description->heights[0].source->description().spacing.value);
  CHECK(height(over_coarse, 44.95, 15.05, Lookup::nearest) == 100);

  MadeWorld over_fine({layer_of(region([](int, int) { return 500.0f; }), 1), layer_of(region(pit), 2)});
  CHECK(height(over_fine, 44.95, 15.05) == doctest::Approx(500));
}

TEST_CASE("heights: are continuous over the edges of voids, borders and poles") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  const auto holes = [seed](int x, int y) { return noise(x / 4, y / 4, seed, 0, 1) < 0.2f ? NAN : noise(x, y, seed, 0, 1000); };
  MadeRaster rough;
  rough.metres = [seed](int x, int y) { return noise(x, y, seed + 1, -3000, 3000); };
  MadeWorld world({layer_of(rough, 1), layer_of(region(holes), 2)});
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> latitude(39.8, 50.2), longitude(9.8, 20.2), anywhere(-1, 1);
  // The steepest that samples 0.1 degrees apart and 4,000 m different can be, over a step, along both axes.
  const double step = 1e-5, steepest = 4000 / 0.1 * step * 3;
  for (int i = 0; i < 20000; ++i) {
    const double lat = latitude(random), lon = longitude(random);
    const double here = height(world, lat, lon);
    REQUIRE(std::abs(height(world, lat + step, lon) - here) < steepest);
    REQUIRE(std::abs(height(world, lat, lon + step) - here) < steepest);
  }
  for (int i = 0; i < 1000; ++i) {
    const double lat = 89.5 * anywhere(random), east = 180 - 1e-7, west = -180 + 1e-7;
    REQUIRE(std::abs(height(world, lat, east) - height(world, lat, west)) < 0.01);
  }
}

TEST_CASE("heights: come from the coarsest level that is as fine as wanted") {
  MadeRaster raster;
  raster.width = 4096, raster.height = 2048;
  raster.metres = [](int x, int) { return x % 2 == 0 ? 0.0f : 100.0f; };
  MadeWorld world({layer_of(raster, 1)});
  const double spacing = world.description->heights[0].source->description().spacing.value;
  const double at_sample = -180 + 360.0 * 100.5 / 4096;
  CHECK(height(world, 0.04, at_sample) == doctest::Approx(0));
  CHECK(height(world, 0.04, at_sample, Lookup::bilinear, 1.99 * spacing) == doctest::Approx(0));
  CHECK(height(world, 0.04, at_sample, Lookup::bilinear, 2.01 * spacing) == doctest::Approx(50));
  CHECK(level_for_spacing(world.description->heights[0].source->description(), 8.1 * spacing) == 3);
  CHECK(level_for_spacing(world.description->heights[0].source->description(), 1e9) == 4);
}

TEST_CASE("surface_normal_at: leans by the gradient of the samples") {
  MadeRaster slope = region([](int x, int) { return 1000.0f * static_cast<float>(x); });
  MadeWorld world({layer_of(slope, 1)});
  const geo::LatLon place = at(45.03, 15.02);
  const glm::dvec3 normal = world.model->surface_normal_at(place)->xyz;
  const glm::dvec3 up = geo::normal_at(place).xyz;
  const glm::dvec3 east(-std::sin(place.longitude.value), std::cos(place.longitude.value), 0);
  // 0.1 degrees along the parallel at that height: (N + h) cos(lat), N of the ellipsoid's prime vertical.
  const double n = geo::kWgs84.a() / std::sqrt(1 - geo::kWgs84.e2() * std::pow(std::sin(place.latitude.value), 2));
  const double run = (n + height(world, 45.03, 15.02)) * std::cos(place.latitude.value) * 0.1 * kPi / 180;
  CHECK(-glm::dot(normal, east) / glm::dot(normal, up) == doctest::Approx(1000 / run).epsilon(1e-6));
  MadeWorld empty({});
  CHECK(empty.model->surface_normal_at(place)->xyz == up);
}

TEST_CASE("grid_normals: are those of tile_normal, to the bit on the borders of faces") {
  for (std::uint8_t face = 0; face < 6; ++face) {
    for (int level = 0; level < 6; ++level) {
      const geo::TileKey key{face, static_cast<std::uint8_t>(level), (1u << level) - 1, 0};
      const auto grid = grid_normals({key, 33, -0.25, 1.25});
      for (std::size_t i = 0; i < grid.size(); ++i) {
        const glm::dvec2 st = glm::dvec2(i % 33, i / 33) / 32.0 * 1.5 - 0.25;
        REQUIRE(glm::distance(grid[i].xyz, geo::tile_normal(key, st).xyz) < 1e-15);
      }
      const auto whole = grid_normals({key, 65});
      const auto beyond = grid_normals({geo::neighbour(key, geo::Side::east), 65});
      int shared = 0;
      for (const auto& normal : whole) shared += std::count(beyond.begin(), beyond.end(), normal) > 0;
      REQUIRE(shared == 65);
    }
  }
}

TEST_CASE("grid_normals: tiles share their borders to the bit") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 200; ++i) {
    const int level = 1 + static_cast<int>(random() % 24);
    geo::TileKey key{static_cast<std::uint8_t>(random() % 6), static_cast<std::uint8_t>(level), 0, 0};
    key.x = static_cast<std::uint32_t>(random() % ((1u << level) - 1));
    key.y = static_cast<std::uint32_t>(random() % (1u << level));
    geo::TileKey east = key;
    ++east.x;
    const auto a = grid_normals({key, kGridSide}), b = grid_normals({east, kGridSide});
    for (std::size_t row = 0; row < kGridSide; ++row) {
      REQUIRE(a[row * kGridSide + kGridSide - 1] == b[row * kGridSide]);
    }
    const auto up = grid_normals({geo::parent(key), kGridSide});
    constexpr std::size_t kHalf = (kGridSide - 1) / 2;
    const std::size_t first = (key.y & 1) * kHalf * kGridSide + (key.x & 1) * kHalf;
    for (std::size_t j = 0; j <= kHalf; ++j) REQUIRE(up[first + j] == a[2 * j]);
  }
}
