// Windows out of made tiles. Expected values by hand.
#include "source/tiles/tile_reader.h"

#include <array>
#include <cmath>
#include <memory>
#include <string>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::source;

namespace {

class MadeTiles final : public TileSupply {
 public:
  fetch::Asked ask(const TileAddress&, const TileWish&) const override { return fetch::File{std::make_shared<const std::string>("tile"), {}, {}}; }
  void reject(const TileAddress&, const std::string&) const override {}
  std::string name_of(const TileAddress&) const override { return "a tile"; }
};

constexpr int kSide = 256;

/// Two levels of 10 and 20 m, the coarser half a pixel further west; a height is the number of its column.
TilePyramid two_levels() {
  TilePyramid pyramid;
  pyramid.name = "made";
  pyramid.grid.crs = "EPSG:32633";
  pyramid.grid.levels = {{{499'990, 5'000'000}, glm::dvec2(20), 2, 1}, {{500'000, 5'000'000}, glm::dvec2(10), 2, 2}};
  pyramid.kind = SampleKind::height;
  pyramid.vertical = "ellipsoid";
  pyramid.decode_heights = [](const std::string&, const TileAddress& tile) -> Result<raster::HeightGrid> {
    raster::HeightGrid grid{kSide, kSide, {}};
    for (int i = 0; i < kSide * kSide; ++i) grid.metres.push_back(static_cast<float>(tile.column * kSide + i % kSide));
    return grid;
  };
  pyramid.is_remote = false;
  pyramid.supply = std::make_shared<const MadeTiles>();
  return pyramid;
}

raster::HeightGrid read(TilePyramid pyramid, int level, const PixelWindow& window) {
  const auto source = open_pyramid(std::move(pyramid), geo::kWgs84);
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  const auto reader = (*source)->open_reader();
  REQUIRE(reader);
  const auto grid = (*reader)->read_heights(level, window);
  REQUIRE(grid);
  return *grid;
}

}  // namespace

TEST_CASE("TileReader: pixels of tiles as large as the raster's are copied where they lie on them, else values between them are taken") {
  const raster::HeightGrid same = read(two_levels(), 0, {250, 10, 12, 2});
  for (int x = 0; x < 12; ++x) CHECK(same.at(x, 1) == static_cast<float>(250 + x));
  const raster::HeightGrid between = read(two_levels(), 1, {240, 10, 16, 2});
  for (int x = 0; x < 16; ++x) CHECK(static_cast<double>(between.at(x, 1)) == doctest::Approx(240.5 + x));
}

TEST_CASE("TileReader: heights that no place of the world has are no data") {
  TilePyramid pyramid = two_levels();
  pyramid.decode_heights = [](const std::string&, const TileAddress&) -> Result<raster::HeightGrid> {
    raster::HeightGrid grid{kSide, kSide, std::vector<float>(kSide * kSide, 1.0f)};
    grid.at(1, 0) = 99'999.0f;  // beyond 1.5 % of the radius
    grid.at(2, 0) = -99'999.0f;
    grid.at(3, 0) = 3.4e38f;
    grid.at(4, 0) = -11'000.0f;
    return grid;
  };
  const raster::HeightGrid grid = read(std::move(pyramid), 0, {0, 0, 6, 1});
  for (const int x : {1, 2, 3}) CHECK(std::isnan(grid.at(x, 0)));
  CHECK(grid.at(4, 0) == -11'000.0f);
  CHECK(grid.at(5, 0) == 1.0f);
}

TEST_CASE("TileReader: a level as far off as no map has no pixels in common") {
  TilePyramid pyramid = two_levels();
  pyramid.grid.levels[0].corner.x = 1e15;
  CHECK(std::isnan(read(std::move(pyramid), 1, {240, 10, 16, 2}).at(3, 1)));
}

TEST_CASE("open_pyramid: a compound CRS says its vertical datum itself, and `vertical` overrules it") {
  TilePyramid pyramid = two_levels();
  pyramid.grid.crs = "EPSG:32633+5773";
  pyramid.vertical.reset();
  const auto source = open_pyramid(pyramid, geo::kWgs84);
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  CHECK((*source)->description().vertical == "EGM96 height");
  CHECK((*source)->description().vertical_declared);
  CHECK((*source)->description().hints.empty());
  // The geoid lies 40 to 50 m above the ellipsoid there.
  const float raised = read(pyramid, 0, {100, 10, 1, 1}).at(0, 0);
  CHECK(raised > 135.0f);
  CHECK(raised < 155.0f);
  pyramid.vertical = "ellipsoid";
  CHECK(read(pyramid, 0, {100, 10, 1, 1}).at(0, 0) == 100.0f);
  pyramid.vertical.reset();
  pyramid.grid.crs = "EPSG:32633";
  CHECK((*open_pyramid(pyramid, geo::kWgs84))->description().hints.size() == 1);
}

TEST_CASE("open_pyramid: the revision tells apart what makes other heights of the same tiles") {
  const auto revision = [](const auto& change) {
    TilePyramid pyramid = two_levels();
    change(pyramid);
    return (*open_pyramid(std::move(pyramid), geo::kWgs84))->revision();
  };
  const std::string plain = revision([](TilePyramid&) {});
  CHECK(revision([](TilePyramid&) {}) == plain);
  CHECK(revision([](TilePyramid& p) { p.encoding = "terrarium"; }) != plain);
  CHECK(revision([](TilePyramid& p) { p.vertical = "egm96"; }) != plain);
  CHECK(revision([](TilePyramid& p) { p.bounds = std::array{15.0, 45.1, 15.01, 45.14}; }) != plain);
}

TEST_CASE("open_pyramid: an attribution is plain text") {
  TilePyramid pyramid = two_levels();
  pyramid.attribution = "<b>Those</b> \x1b[31mwho\nmade\xc2\x9b it";
  CHECK((*open_pyramid(std::move(pyramid), geo::kWgs84))->description().attribution == "Those [31mwhomade it");
}
