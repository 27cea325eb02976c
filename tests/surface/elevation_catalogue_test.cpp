// Height layers of many rasters.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "source/catalogue/catalogue.h"
#include "surface/elevation_model.h"
#include "surface/made_world.h"
#include "surface/tile_grid.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

/// A layer of rasters, the lowest first.
Layer catalogue_of(const std::vector<MadeRaster>& rasters, std::uint32_t first_id) {
  source::Catalogue::Sets sets;
  for (std::size_t i = 0; i < rasters.size(); ++i) {
    const MadeSource source(rasters[i]);
    const auto reader = std::move(source.open_reader()).value();
    const auto ring = source::ring_of_raster(*reader, source.description().levels.front());
    const auto number = static_cast<std::uint32_t>(i);
    sets.push_back(std::make_shared<source::DataSet>(source::DataSet{
        first_id + number, std::to_string(i), number, source::Footprint(ring, source.description().spacing, geo::kWgs84)}));
  }
  auto open = std::make_shared<source::OpenDataSets>([rasters](const std::string& path) -> Result<std::unique_ptr<source::RasterSource>> {
    return std::unique_ptr<source::RasterSource>(std::make_unique<MadeSource>(rasters[std::stoul(path)]));
  });
  Layer layer;
  layer.name = "catalogue";
  layer.catalogue = std::make_shared<source::Catalogue>(std::move(sets), source::CatalogueOrder::listed, std::move(open));
  return layer;
}

/// 10..20 E, 40..50 N with a sample every 0.05 degrees, cut into `pieces` x `pieces`.
std::vector<MadeRaster> cut(int pieces, const std::function<float(int, int)>& metres) {
  constexpr int kSide = 200;
  std::vector<MadeRaster> rasters;
  for (int row = 0; row < pieces; ++row) {
    for (int column = 0; column < pieces; ++column) {
      const int left = kSide * column / pieces, right = kSide * (column + 1) / pieces, top = kSide * row / pieces, bottom = kSide * (row + 1) / pieces;
      MadeRaster piece;
      piece.width = right - left, piece.height = bottom - top;
      piece.west = 10 + 0.05 * left, piece.east = 10 + 0.05 * right, piece.north = 50 - 0.05 * top, piece.south = 50 - 0.05 * bottom;
      piece.metres = [metres, left, top](int x, int y) { return metres(left + x, top + y); };
      rasters.push_back(std::move(piece));
    }
  }
  return rasters;
}

double height(MadeWorld& world, double latitude, double longitude) {
  return world.model->height_at(at(latitude, longitude), Lookup::bilinear)->metres;
}

}  // namespace

TEST_CASE("heights of a catalogue: a void over the border of two rasters is filled from both, and no cliff is left") {
  const auto void_over_the_middle = [](int x, int y) {
    return std::abs(x - 100) < 12 && std::abs(y - 100) < 12 ? NAN : 3000.0f + 5.0f * static_cast<float>(x) + 2.0f * static_cast<float>(y);
  };
  MadeWorld world({catalogue_of(cut(4, void_over_the_middle), 10)});
  for (double shift = -0.5; shift <= 0.5; shift += 0.01) {
    CAPTURE(shift);
    CHECK(height(world, 45, 15 + shift) == doctest::Approx(3700).epsilon(0.03));
    CHECK(height(world, 45 + shift, 15) == doctest::Approx(3700).epsilon(0.03));
  }
}

TEST_CASE("heights of a catalogue: are continuous over voids and the borders of rasters, above a coarse layer") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  const auto holes = [seed](int x, int y) { return noise(x / 9, y / 9, seed, 0, 1) < 0.3f ? NAN : noise(x, y, seed, 0, 1000); };
  MadeRaster rough;
  rough.metres = [seed](int x, int y) { return noise(x, y, seed + 1, -3000, 3000); };
  MadeWorld world({layer_of(rough, 1), catalogue_of(cut(3, holes), 10)});
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> latitude(39.9, 50.1), longitude(9.9, 20.1);
  const double step = 1e-5, steepest = 4000 / 0.05 * step * 3;
  for (int i = 0; i < 20000; ++i) {
    const double lat = latitude(random), lon = longitude(random);
    const double here = height(world, lat, lon);
    REQUIRE(std::abs(height(world, lat + step, lon) - here) < steepest);
    REQUIRE(std::abs(height(world, lat, lon + step) - here) < steepest);
  }
  for (int i = 0; i < 2000; ++i) {  // across the borders of the rasters
    const double border = 10 + 0.05 * (200 * (1 + i % 2) / 3), along = latitude(random);
    REQUIRE(std::abs(height(world, along, border + step / 2) - height(world, along, border - step / 2)) < steepest);
  }
}

TEST_CASE("heights of a catalogue: tiles side by side agree on their border, whatever else each of them sees") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  const auto holes = [seed](int x, int y) { return noise(x / 9, y / 9, seed, 0, 1) < 0.3f ? NAN : noise(x, y, seed, 0, 1000); };
  MadeWorld world({catalogue_of(cut(5, holes), 10)});
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> near(-0.4, 0.4);
  constexpr int kSide = 65;
  std::vector<double> left(kSide * kSide), right(kSide * kSide);
  for (int i = 0; i < 60; ++i) {
    const geo::TileKey key = geo::tile_at(geo::normal_at(at(46 + near(random), 16 + near(random))), 7 + i % 4);
    const geo::TileKey east = geo::neighbour(key, geo::Side::east);
    REQUIRE(east.face == key.face);
    REQUIRE(world.model->heights(TileLattice{key, kSide}, 0, left));
    REQUIRE(world.model->heights(TileLattice{east, kSide}, 0, right));
    for (std::size_t row = 0; row < kSide; ++row) REQUIRE(std::abs(left[row * kSide + kSide - 1] - right[row * kSide]) < 0.01);
  }
}

TEST_CASE("heights of a catalogue: of a layer that adds, the uppermost raster is added, once") {
  const auto even = [](float metres) { return [metres](int, int) { return metres; }; };
  std::vector<MadeRaster> rasters = cut(1, even(20));
  rasters.push_back(cut(1, even(50)).front());
  Layer layer = catalogue_of(rasters, 10);
  layer.adds = true;
  MadeRaster globe;
  globe.metres = even(1000);
  MadeWorld world({layer_of(globe, 1), layer});
  CHECK(height(world, 45, 15) == doctest::Approx(1050));
  CHECK(world.model->height_at(at(45, 15), Lookup::nearest)->metres == doctest::Approx(1050));
  CHECK(height(world, 45, 5) == doctest::Approx(1000));
}
