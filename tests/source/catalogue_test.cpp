// Expected values: rectangles of latitudes and longitudes compared by hand, and a search through all data sets.
#include "source/catalogue/catalogue.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "geo/ellipsoid.h"

using namespace tellurion;
using source::Catalogue;
using source::DataSet;
using source::Footprint;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

geo::LatLon at(double lat, double lon) { return {to_radians(Degrees(lat)), to_radians(Degrees(lon))}; }

/// A rectangle of latitudes and longitudes, with steps as rasters have them.
std::vector<geo::LatLon> ring(double south, double west, double north, double east) {
  const double corners[4][2] = {{north, west}, {north, east}, {south, east}, {south, west}};
  std::vector<geo::LatLon> places;
  for (int edge = 0; edge < 4; ++edge) {
    for (int i = 0; i < source::kRingSteps; ++i) {
      const double t = static_cast<double>(i) / source::kRingSteps;
      places.push_back(at(std::lerp(corners[edge][0], corners[(edge + 1) % 4][0], t), std::lerp(corners[edge][1], corners[(edge + 1) % 4][1], t)));
    }
  }
  return places;
}

struct Rectangle {
  double south, west, north, east;
  bool holds(double lat, double lon) const {
    double turn = lon - west;
    turn -= 360.0 * std::floor(turn / 360.0);
    return lat >= south && lat <= north && turn <= east - west;
  }
};

struct Random {
  std::mt19937 engine;
  std::vector<Rectangle> rectangles;
  Catalogue::Sets sets;

  Random(unsigned seed, int count) : engine(seed) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int i = 0; i < count; ++i) {
      const double lat = std::asin(2.0 * unit(engine) - 1.0) / kDegree, lon = 360.0 * unit(engine) - 180.0;
      const double size = std::pow(10.0, -3.0 + 4.0 * unit(engine));
      const double tall = std::min({size, 89.9 - lat, lat + 89.9}), wide = std::min(size / std::cos(lat * kDegree), 60.0);
      if (tall <= 0.0) continue;
      const Rectangle r{lat - tall, lon - wide, lat + tall, lon + wide};
      rectangles.push_back(r);
      const auto id = static_cast<std::uint32_t>(sets.size());
      sets.push_back(std::make_shared<const DataSet>(DataSet{id, std::to_string(id), i, Footprint(ring(r.south, r.west, r.north, r.east), Metres(std::exp(unit(engine) * 10.0)), geo::kWgs84)}));
    }
  }
};

}  // namespace

TEST_CASE("Footprint: touches every tile that holds a place of the data set, anywhere on the globe") {
  const unsigned seed = 20261123;
  CAPTURE(seed);
  Random made(seed, 300);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (std::size_t i = 0; i < made.sets.size(); ++i) {
    const Rectangle& r = made.rectangles[i];
    for (int k = 0; k < 40; ++k) {
      const geo::LatLon place = at(std::lerp(r.south, r.north, unit(made.engine)), std::lerp(r.west, r.east, unit(made.engine)));
      for (const int level : {0, 1, 3, 6, 10, 16, 24}) REQUIRE(made.sets[i]->footprint.touches(geo::tile_at(geo::normal_at(place), level)));
    }
  }
}

TEST_CASE("Footprint: does not touch tiles clearly beside it") {
  const Footprint footprint(ring(10.0, 20.0, 11.0, 21.0), Metres(30), geo::kWgs84);
  for (const auto& [lat, lon] : {std::pair{10.5, 19.8}, {10.5, 21.2}, {9.8, 20.5}, {11.2, 20.5}, {-10.5, 20.5}, {10.5, -159.5}})
    CHECK_FALSE(footprint.touches(geo::tile_at(geo::normal_at(at(lat, lon)), 12)));
  // A narrow strip that runs aslant: the box round it holds much that it does not touch.
  std::vector<geo::LatLon> strip;
  const double corners[4][2] = {{0.0, 0.0}, {5.0, 5.0}, {5.1, 5.0}, {0.1, 0.0}};
  for (int edge = 0; edge < 4; ++edge) {
    for (int i = 0; i < 8; ++i) strip.push_back(at(std::lerp(corners[edge][0], corners[(edge + 1) % 4][0], i / 8.0), std::lerp(corners[edge][1], corners[(edge + 1) % 4][1], i / 8.0)));
  }
  const Footprint aslant(strip, Metres(5), geo::kWgs84);
  CHECK(aslant.touches(geo::tile_at(geo::normal_at(at(2.55, 2.5)), 10)));
  CHECK_FALSE(aslant.touches(geo::tile_at(geo::normal_at(at(1.0, 4.0)), 10)));
}

TEST_CASE("Footprint: data sets round a pole, across the antimeridian and round the body") {
  std::vector<geo::LatLon> round_pole;
  for (int i = 0; i < 32; ++i) round_pole.push_back(at(-75.0, i * 11.25));
  const Footprint pole(round_pole, Metres(1000), geo::kWgs84);
  CHECK(pole.touches(geo::tile_at(geo::normal_at(at(-90.0, 0.0)), 20)));
  CHECK(pole.touches(geo::tile_at(geo::normal_at(at(-80.0, 130.0)), 20)));
  CHECK_FALSE(pole.touches(geo::tile_at(geo::normal_at(at(-70.0, 130.0)), 8)));
  CHECK_FALSE(pole.touches(geo::tile_at(geo::normal_at(at(90.0, 0.0)), 8)));

  const Footprint across(ring(-1.0, 179.0, 1.0, 182.0), Metres(30), geo::kWgs84);
  CHECK(across.touches(geo::tile_at(geo::normal_at(at(0.5, 179.5)), 14)));
  CHECK(across.touches(geo::tile_at(geo::normal_at(at(0.5, -178.5)), 14)));
  CHECK_FALSE(across.touches(geo::tile_at(geo::normal_at(at(0.5, 0.0)), 3)));

  const Footprint whole(ring(-90.0, -180.0, 90.0, 180.0), Metres(1000), geo::kWgs84);
  for (std::uint8_t face = 0; face < 6; ++face) CHECK(whole.touches({face, 3, 5, 2}));
  CHECK(whole.extent().value > 6.28);
}

TEST_CASE("Catalogue: finds what a search through all data sets finds, the uppermost first") {
  const unsigned seed = 7;
  CAPTURE(seed);
  Random made(seed, 3000);
  const auto sets = made.sets;
  for (const auto order : {source::CatalogueOrder::finest, source::CatalogueOrder::listed}) {
    const Catalogue catalogue(sets, order, nullptr);
    std::uniform_int_distribution<std::uint32_t> any;
    std::size_t hits = 0;
    for (int i = 0; i < 300; ++i) {
      const auto& some = made.rectangles[any(made.engine) % made.rectangles.size()];
      const geo::TileKey key = geo::tile_at(geo::normal_at(at(some.south, some.west)), static_cast<int>(any(made.engine) % 14));
      const auto region = source::region_of(key);
      const Radians least((i % 3) * 0.001);
      std::vector<std::uint32_t> found, expected;
      catalogue.find(region, least, found);
      for (std::uint32_t k = 0; k < catalogue.sets().size(); ++k) {
        const Footprint& footprint = catalogue.sets()[k]->footprint;
        if (footprint.extent().value >= least.value && footprint.touches(region)) expected.insert(expected.begin(), k);
      }
      REQUIRE(found == expected);
      hits += found.size();
      double finest = INFINITY;
      for (const auto& set : sets) {
        if (set->footprint.touches(region)) finest = std::min(finest, set->footprint.spacing().value);
      }
      REQUIRE(catalogue.spacing_under(key).value == finest);
      REQUIRE(catalogue.touches(key) == (finest < INFINITY));
    }
    CHECK(hits > 300);
    for (std::size_t k = 1; k < sets.size(); ++k) {
      const DataSet &below = *catalogue.sets()[k - 1], &above = *catalogue.sets()[k];
      if (order == source::CatalogueOrder::finest) REQUIRE(below.footprint.spacing().value >= above.footprint.spacing().value);
      else REQUIRE(below.place <= above.place);
    }
  }
}

TEST_CASE("Catalogue: changed holds what came and not what went; difference tells both") {
  Random made(3, 50);
  const Catalogue before({made.sets.begin(), made.sets.begin() + 20}, source::CatalogueOrder::listed, nullptr);
  const std::vector<std::uint32_t> gone{3, 7};
  const auto now = before.changed({made.sets.begin() + 20, made.sets.begin() + 22}, gone);
  CHECK(now->sets().size() == 20);
  std::vector<std::uint32_t> ids;
  for (const auto& set : source::difference(before, *now)) ids.push_back(set->id);
  CHECK(ids == std::vector<std::uint32_t>{3, 7, 20, 21});
  CHECK(source::difference(before, before).empty());
}

TEST_CASE("Catalogue: an empty one touches nothing") {
  const Catalogue none({}, source::CatalogueOrder::finest, nullptr);
  CHECK_FALSE(none.touches({0, 0, 0, 0}));
  CHECK(std::isinf(none.spacing_under({0, 0, 0, 0}).value));
}

TEST_CASE("OpenDataSets: opens each once, remembers what cannot be opened, but not what may come back") {
  int opened = 0;
  source::OpenDataSets sets([&](const std::string& path) -> Result<std::unique_ptr<source::RasterSource>> {
    ++opened;
    return Error{path == "later" ? ErrorCode::unavailable : ErrorCode::corrupt, path + ": no"};
  });
  const Footprint somewhere(ring(0, 0, 1, 1), Metres(1), geo::kWgs84);
  const DataSet bad{1, "bad", 0, somewhere}, later{2, "later", 1, somewhere};
  for (int i = 0; i < 3; ++i) {
    CHECK_FALSE(sets.open(bad));
    CHECK_FALSE(sets.open(later));
  }
  CHECK(opened == 4);
  CHECK(sets.failures().count == 1);
  CHECK(sets.opened_ids().empty());
}
