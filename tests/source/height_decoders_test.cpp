#include "source/tiles/height_decoders.h"

#include <cmath>
#include <string>

#include <doctest/doctest.h>

#include "raster/made_mesh.h"

using namespace tellurion;
using namespace tellurion::source;

namespace {

/// A mesh whose height is its share of the way from the southern to the northern edge, in hundredths.
std::string slope() {
  test::MadeMesh mesh;
  mesh.highest = 100;
  mesh.vertices = {{0, 0, 0}, {32767, 0, 0}, {0, 32767, 32767}, {32767, 32767, 32767}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  return test::encoded(mesh);
}

}  // namespace

TEST_CASE("height_decoder: a mesh of a geographic tile has rows evenly by latitude") {
  const auto grid = geographic_grid(64, 0, 3, geo::kWgs84);
  REQUIRE(grid);
  const auto heights = height_decoder(kQuantizedMesh, *grid)(slope(), {2, 1, 0});
  REQUIRE(heights);
  CHECK(heights->width == 64);
  for (int j = 0; j < 64; ++j) CHECK(heights->at(20, j) == doctest::Approx(100 * (1 - (j + 0.5) / 64)));
}

// Latitudes by hand from the inverse of the Mercator projection, 2 atan(exp(y)) - pi/2.
TEST_CASE("height_decoder: a mesh of a tile in Web Mercator goes evenly by latitude too") {
  const auto grid = web_mercator_grid(64, 0, 3);
  REQUIRE(grid);
  const auto heights = height_decoder(kQuantizedMesh, *grid)(slope(), {1, 0, 0});  // from the equator to 85.05 degrees north
  REQUIRE(heights);
  const double pi = std::acos(-1.0), north = 2 * std::atan(std::exp(pi)) - pi / 2;
  for (const int j : {0, 10, 31, 32, 63}) {
    const double y = pi * (1 - (j + 0.5) / 64);
    CHECK(heights->at(0, j) == doctest::Approx(100 * (2 * std::atan(std::exp(y)) - pi / 2) / north));
  }
  const auto southern = height_decoder(kQuantizedMesh, *grid)(slope(), {1, 0, 1});
  REQUIRE(southern);
  CHECK(southern->at(0, 63) == doctest::Approx(100 - static_cast<double>(heights->at(0, 0))));
}

TEST_CASE("height_decoder: heightmaps take the tile's size") {
  const auto grid = web_mercator_grid(48, 0, 3);
  REQUIRE(grid);
  std::string tile;
  for (int i = 0; i < 65 * 65; ++i) tile += std::string("\x8c\x13", 2);  // 5004 fifths of a metre over -1000 m
  const auto heights = height_decoder(kHeightmap, *grid)(tile, {0, 0, 0});
  REQUIRE(heights);
  CHECK(heights->width == 48);
  CHECK(heights->height == 48);
  CHECK(heights->at(47, 0) == doctest::Approx(0.8));
  CHECK_FALSE(height_decoder(kHeightmap, *grid)("<html>", {0, 0, 0}));
}

TEST_CASE("is_height_encoding: knows what height_decoder decodes, and lists it") {
  for (const std::string name : {"terrarium", "terrain-rgb", "centimetres", "quantized-mesh", "heightmap"}) {
    CHECK(is_height_encoding(name));
    CHECK(height_encodings().find(name) != std::string::npos);
  }
  CHECK_FALSE(is_height_encoding(""));
  CHECK_FALSE(is_height_encoding("morse"));
}
