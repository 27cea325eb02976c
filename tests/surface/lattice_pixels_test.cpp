#include "surface/lattice_pixels.h"

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "source/gdal/gdal_source.h"
#include "surface/made_world.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

const std::vector<TileLattice> kShapes{{{}, 129}, {{}, 65}, {{}, 259, -0.5 / 128, 1.0 + 0.5 / 128}, {{}, 17}, {{}, 30, 0.1, 0.8}};

/// How far a lattice's pixels are from those projected one by one; in pixels of the level, round the body where it wraps.
double largest_distance(const TileLattice& lattice, source::RasterReader& reader, const source::RasterDescription& raster, int level) {
  const auto normals = grid_normals(lattice);
  std::vector<geo::LatLon> places;
  for (const auto& normal : normals) places.push_back(geo::place_of_normal(normal));
  std::vector<glm::dvec2> exact(places.size()), found(places.size());
  reader.to_pixels(places, exact);
  // In two parts, as nobody needs all at once.
  const auto in_raster = LatticePixels(lattice).in_raster(reader, raster, level);
  const auto half = static_cast<std::size_t>(lattice.side / 2) * static_cast<std::size_t>(lattice.side);
  in_raster.rows(0, std::span(found).first(half));
  in_raster.rows(lattice.side / 2, std::span(found).subspan(half));
  const glm::dvec2 scale = source::level_scale(raster, level);
  const double width = raster.levels.front().width;
  double largest = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (std::isnan(exact[i].x) && std::isnan(found[i].x)) continue;
    glm::dvec2 off = found[i] - exact[i];
    if (raster.wraps) {
      off.x = std::remainder(off.x, width);
      CHECK(found[i].x >= 0.0);
      CHECK(found[i].x <= width);
    }
    const double distance = std::max(std::abs(off.x * scale.x), std::abs(off.y * scale.y));
    if (!(distance <= largest)) largest = distance;
  }
  return largest;
}

geo::TileKey key_over(double latitude, double longitude, int level) {
  return geo::tile_at(geo::normal_at(at(latitude, longitude)), level);
}

}  // namespace

TEST_CASE("LatticePixels: the pixels of a raster round the whole body, at poles, the antimeridian and the faces' borders too") {
  MadeRaster made;
  made.width = 43200, made.height = 21600;
  const MadeSource source(made);
  const auto reader = std::move(source.open_reader()).value();
  for (const auto& [latitude, longitude] : {std::pair{46.7, -121.8}, {89.99, 10.0}, {-90.0, 0.0}, {12.0, 179.999}, {-35.26, 45.0}, {0.0, 0.0}}) {
    for (const int level : {0, 1, 3, 5, 8, 12, 18, 24}) {
      for (TileLattice lattice : kShapes) {
        lattice.key = key_over(latitude, longitude, level);
        CAPTURE(geo::to_string(lattice.key));
        CAPTURE(lattice.side);
        CHECK(largest_distance(lattice, *reader, source.description(), 0) < 1e-5);
        CHECK(largest_distance(lattice, *reader, source.description(), 4) < 1e-5);
      }
    }
  }
}

TEST_CASE("LatticePixels: the pixels of real rasters in projections of PROJ") {
  for (const char* const path : {"earth/elevation/arctic_polar_stereographic.tif", "earth/regional/mt_rainier_90m.tif"}) {
    const std::string file = std::string(TELLURION_SHARED_DATA_DIR) + "/" + path;
    if (!std::filesystem::exists(file)) continue;
    const auto source = source::open_gdal({.path = file}, geo::kWgs84);
    REQUIRE(source);
    const auto reader = std::move((*source)->open_reader()).value();
    for (const auto& [latitude, longitude] : {std::pair{46.85, -121.76}, {89.999, 0.0}, {75.0, -179.9999}, {80.0, 45.0}}) {
      for (const int level : {2, 6, 10, 14}) {
        const TileLattice lattice{key_over(latitude, longitude, level), 129};
        CAPTURE(path);
        CAPTURE(geo::to_string(lattice.key));
        CHECK(largest_distance(lattice, *reader, (*source)->description(), 0) < 1e-5);
      }
    }
  }
}

TEST_CASE("LatticePixels: bounds hold every point") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 300; ++i) {
    TileLattice lattice = kShapes[random() % kShapes.size()];
    const int level = static_cast<int>(random() % 20);
    std::uniform_real_distribution<double> latitude(-90, 90), longitude(-180, 180);
    lattice.key = i % 4 == 0 ? key_over(89.9999, longitude(random), level) : key_over(latitude(random), longitude(random), level);
    const LatticePixels pixels(lattice);
    CAPTURE(geo::to_string(lattice.key));
    bool all = true;
    for (const auto& normal : grid_normals(lattice)) {
      const geo::LatLon place = geo::place_of_normal(normal);
      all = all && overlap(pixels.bounds(), {place.latitude, place.latitude, place.longitude, place.longitude});
    }
    CHECK(all);
  }
}

TEST_CASE("overlap: over the antimeridian, round the body, and not at all") {
  const auto bounds = [](double south, double north, double west, double east) {
    const auto lower = at(south, west), upper = at(north, east);
    return geo::GeodeticBounds{lower.latitude, upper.latitude, lower.longitude, upper.longitude};
  };
  CHECK(overlap(bounds(0, 10, 170, 190), bounds(5, 6, -175, -170)));
  CHECK(overlap(bounds(5, 6, -175, -170), bounds(0, 10, 170, 190)));
  CHECK(overlap(bounds(-90, 90, -180, 180), bounds(5, 6, 30, 40)));
  CHECK(overlap(bounds(5, 6, 30, 40), bounds(-90, 90, -180, 180)));
  CHECK(overlap(bounds(0, 1, 0, 1), bounds(1, 2, 1, 2)));
  CHECK_FALSE(overlap(bounds(0, 10, 170, 190), bounds(5, 6, -169, -160)));
  CHECK_FALSE(overlap(bounds(0, 10, 170, 190), bounds(11, 12, 170, 190)));
  CHECK_FALSE(overlap(bounds(5, 6, 30, 40), bounds(5, 6, 41, 50)));
}
