#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <GeographicLib/Ellipsoid.hpp>
#include <doctest/doctest.h>

#include "source/debug/block_letters.h"
#include "source/debug/footprint.h"
#include "source/debug/scale_reference.h"
#include "source/debug/tile_index.h"
#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::source;

namespace {

const GeographicLib::Ellipsoid kEarth(6378137.0, 1.0 / 298.257223563);

struct Opened {
  std::unique_ptr<RasterSource> source;
  std::unique_ptr<RasterReader> reader;
};

Opened opened(Result<std::unique_ptr<RasterSource>> source) {
  REQUIRE_MESSAGE(source, source.error().message);
  auto reader = (*source)->open_reader();
  REQUIRE(reader);
  return {std::move(*source), std::move(*reader)};
}

/// The level of a pyramid of tiles of 256 pixels that shows a zoom.
int level_of_zoom(const RasterSource& source, int zoom, int tiles_across) {
  const auto& levels = source.description().levels;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (levels[i].width == tiles_across * 256 << zoom) return static_cast<int>(i);
  }
  FAIL("no such level");
  return -1;
}

glm::dvec2 pixel_of(RasterReader& reader, double latitude, double longitude) {
  const geo::LatLon place{to_radians(Degrees(latitude)), to_radians(Degrees(longitude))};
  glm::dvec2 pixel;
  reader.to_pixels({&place, 1}, {&pixel, 1});
  return pixel;
}

bool is_white(const raster::Image& image, int x, int y) { return image.at(x, y) == std::array<std::uint8_t, 4>{255, 255, 255, 255}; }

/// The smallest box round the white pixels: x, y, width, height.
PixelWindow white_box(const raster::Image& image) {
  int x0 = image.width, y0 = image.height, x1 = -1, y1 = -1;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!is_white(image, x, y)) continue;
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  }
  return {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

}  // namespace

TEST_CASE("block letters: every letter of a label is another one") {
  const std::string all = "0123456789/.km";
  const auto ink = [](char c) {
    std::string cells;
    for (int y = 0; y < kLetterHeight; ++y) {
      for (int x = 0; x < kLetterWidth; ++x) cells += is_inked(std::string(1, c), x, y) ? '#' : ' ';
    }
    return cells;
  };
  for (const char a : all) {
    CHECK(ink(a).find('#') != std::string::npos);
    for (const char b : all) CHECK((a == b) == (ink(a) == ink(b)));
  }
  CHECK_FALSE(is_inked("1", -1, 0));
  CHECK_FALSE(is_inked("1", 0, 7));
  CHECK_FALSE(is_inked("11", kLetterWidth, 6));
  CHECK(is_inked_nearby("11", kLetterWidth, 6));
}

TEST_CASE("tile index: a tile has a border and its label in the middle") {
  const Opened tiles = opened(open_tile_index({}, geo::kWgs84));
  const int level = level_of_zoom(*tiles.source, 3, 1);
  const auto image = tiles.reader->read_colours(level, {5 * 256, 2 * 256, 256, 256});
  REQUIRE(image);
  // "3/5/2": five letters of five cells and four gaps, a cell being 5 pixels.
  const PixelWindow box = white_box(*image);
  CHECK(box.width == 29 * 5);
  CHECK(box.height == 7 * 5);
  CHECK(std::abs(2 * box.x + box.width - 256) <= 1);
  CHECK(std::abs(2 * box.y + box.height - 256) <= 5);
  for (int i = 0; i < 256; ++i) {
    for (const auto& pixel : {image->at(i, 0), image->at(i, 255), image->at(0, i), image->at(255, i)}) CHECK(pixel == std::array<std::uint8_t, 4>{0, 0, 0, 255});
  }
  CHECK(image->at(20, 20)[3] == 0);
}

TEST_CASE("tile index: tiles lie where the usual numbering has them") {
  // The numbers of the tile over Berlin at zoom 10, by the formula of OpenStreetMap's "Slippy map tilenames".
  const Opened tiles = opened(open_tile_index({}, geo::kWgs84));
  const int level = level_of_zoom(*tiles.source, 10, 1);
  const glm::dvec2 at = pixel_of(*tiles.reader, 52.52, 13.405) * level_scale(tiles.source->description(), level) / 256.0;
  const double y = (1.0 - std::asinh(std::tan(52.52 * std::numbers::pi / 180)) / std::numbers::pi) / 2 * 1024;
  CHECK(at.x == doctest::Approx((13.405 + 180) / 360 * 1024).epsilon(1e-9));
  CHECK(at.y == doctest::Approx(y).epsilon(1e-9));
  CHECK(static_cast<int>(at.x) == 550);
  CHECK(static_cast<int>(at.y) == 335);
  const Opened geographic = opened(open_tile_index({true, 256}, geo::kWgs84));
  const glm::dvec2 south_east = pixel_of(*geographic.reader, -89.0, 179.0) * level_scale(geographic.source->description(), level_of_zoom(*geographic.source, 1, 2)) / 256.0;
  CHECK(static_cast<int>(south_east.x) == 3);
  CHECK(static_cast<int>(south_east.y) == 1);
}

TEST_CASE("debug sources: a window holds what any other window shows there") {
  for (auto& drawn : {opened(open_tile_index({}, geo::kWgs84)), opened(open_tile_index({true, 300}, geo::kMars)),
                      opened(open_scale_reference(ScaleUnit::kilometres, geo::kWgs84)), opened(open_scale_reference(ScaleUnit::metres, geo::kMoon))}) {
    const auto& levels = drawn.source->description().levels;
    CHECK(levels.back().width <= 256);
    CHECK(levels.back().height <= 256);
    for (const std::size_t level : {std::size_t{0}, levels.size() / 2, levels.size() - 1}) {
      const LevelSize& size = levels[level];
      const int side = std::min({300, size.width, size.height});
      // In the middle, and in the corner at a pole and longitude 180.
      for (const auto& corner : {glm::ivec2((size.width - side) / 2, (size.height - side) / 2), glm::ivec2(size.width - side, size.height - side)}) {
        const auto whole = drawn.reader->read_colours(static_cast<int>(level), {corner.x, corner.y, side, side});
        const auto part = drawn.reader->read_colours(static_cast<int>(level), {corner.x + side / 3, corner.y + side / 2, side / 4, side / 5});
        REQUIRE(whole);
        REQUIRE(part);
        bool same = true;
        for (int y = 0; y < part->height; ++y) {
          for (int x = 0; x < part->width; ++x) same = same && part->at(x, y) == whole->at(x + side / 3, y + side / 2);
        }
        CHECK(same);
      }
    }
  }
}

TEST_CASE("meridian_arc: agrees with GeographicLib, and its reverse with itself") {
  for (double latitude = -90; latitude <= 90; latitude += 7.5) {
    const Metres arc = meridian_arc(geo::kWgs84, to_radians(Degrees(latitude)));
    CHECK(std::abs(arc.value - kEarth.MeridianDistance(latitude)) < 1e-3);
    CHECK(std::abs(to_degrees(latitude_of_arc(geo::kWgs84, arc)).value - latitude) < 1e-9);
  }
  const geo::Ellipsoid lens{Metres(2e6), Metres(1.2e6)};
  const GeographicLib::Ellipsoid truth(2e6, 0.4);
  CHECK(std::abs(meridian_arc(lens, to_radians(Degrees(60))).value - truth.MeridianDistance(60)) < 1.0);
}

TEST_CASE("scale reference: lines are as far apart on the ground as the cells are large") {
  const Opened scale = opened(open_scale_reference(ScaleUnit::kilometres, geo::kWgs84));
  // A level of about 306 m a pixel: the least round size of 160 pixels and more is 50 km.
  const auto& levels = scale.source->description().levels;
  int level = 0;
  while (levels[static_cast<std::size_t>(level)].width != 1 << 17) ++level;
  constexpr double kDegrees = 360.0 / (1 << 17), kCell = 50e3;
  // Down a meridian every line is where it should be, and there is little white besides.
  const int column = static_cast<int>((180 + 10.0) / kDegrees);
  constexpr int kFirstRow = (1 << 16) / 4, kRows = 12000;  // from 45 degrees north on, 3,660 km
  const auto strip = scale.reader->read_colours(level, {column, kFirstRow, 1, kRows});
  REQUIRE(strip);
  int lines = 0, white = 0;
  for (int y = 0; y < kRows; ++y) white += is_white(*strip, 0, y) ? 1 : 0;
  for (int cell = static_cast<int>(kEarth.MeridianDistance(44.99) / kCell); cell * kCell > kEarth.MeridianDistance(12.5); --cell) {
    double latitude = cell * kCell / 111e3;
    for (int i = 0; i < 20; ++i) latitude += (cell * kCell - kEarth.MeridianDistance(latitude)) / 111e3;
    const int y = static_cast<int>(std::floor((90 - latitude) / kDegrees)) - kFirstRow;
    if (y >= kRows) break;
    CHECK(is_white(*strip, 0, y));
    ++lines;
  }
  CHECK(lines >= 70);
  CHECK(white < kRows / 8);
  // Along the middle parallel of the row of cells from 5000 to 5050 km.
  double latitude = 45;
  for (int i = 0; i < 20; ++i) latitude += (5025e3 - kEarth.MeridianDistance(latitude)) / 111e3;
  const int row = static_cast<int>((90 - latitude) / kDegrees);
  const auto across = scale.reader->read_colours(level, {1 << 16, row, 12000, 1});
  REQUIRE(across);
  const double metres_per_pixel = kEarth.CircleRadius(latitude) * kDegrees * std::numbers::pi / 180;
  for (int cell = 1; cell * kCell < 11990 * metres_per_pixel; ++cell) {
    const int at = static_cast<int>(cell * kCell / metres_per_pixel);
    CHECK(is_white(*across, at, 0));
    CHECK(across->at(at + 25, 0)[3] == 0);  // past the tick, before the number
  }
}

TEST_CASE("image: a picture without a georeference lies over the bounds that are said") {
  test::MadeRaster raster;
  raster.width = 40;
  raster.height = 10;
  raster.type = GDT_Byte;
  raster.crs.clear();
  raster.transform.reset();
  for (int band = 0; band < 3; ++band) raster.values.push_back(test::ramp(400, 0, 0.5));
  const test::MadeFile file("plain_picture.tif", raster);
  GdalOptions options;
  options.path = file.path();
  CHECK_FALSE(open_gdal(options, geo::kWgs84));
  options.bounds = {170.0, -10.0, 210.0, 0.0};  // across longitude 180
  const Opened picture = opened(open_gdal(options, geo::kWgs84));
  const glm::dvec2 at = pixel_of(*picture.reader, -2.5, -175.5);
  CHECK(at.x == doctest::Approx(14.5));
  CHECK(at.y == doctest::Approx(2.5));
  const auto pixel = picture.reader->read_colours(0, {14, 2, 1, 1});
  REQUIRE(pixel);
  CHECK(pixel->at(0, 0)[0] == 47);
  options.bounds = {-180.0, -90.0, 180.0, 90.0};
  const Opened globe = opened(open_gdal(options, geo::kMoon));
  CHECK(globe.source->description().wraps);
  CHECK(pixel_of(*globe.reader, 90.0, -180.0) == glm::dvec2(0.0));
}

TEST_CASE("footprint: tints the raster's ground in its own projection, with a line along its border; a ring shows where a small one lies") {
  test::MadeRaster raster;
  raster.width = raster.height = 600;
  raster.crs = "EPSG:3031";
  raster.transform = {-3e6, 1e4, 0.0, 3e6, 0.0, -1e4};
  raster.values = {std::vector<double>(360000, 1.0)};
  const test::MadeFile file("polar_square.tif", raster);
  GdalOptions options;
  options.path = file.path();
  std::shared_ptr<const RasterSource> square = *open_gdal(options, geo::kWgs84);
  CHECK(to_degrees(middle_of(*square).latitude).value == doctest::Approx(-90.0));
  const Opened footprint = opened(open_footprint(square, geo::kWgs84));
  const auto ink = [](const Opened& drawn, double latitude, double longitude) {
    const glm::dvec2 at = pixel_of(*drawn.reader, latitude, longitude);
    const auto pixel = drawn.reader->read_colours(0, {static_cast<int>(at.x), static_cast<int>(at.y), 1, 1});
    REQUIRE(pixel);
    return pixel->at(0, 0)[3];
  };
  // By the polar stereographic formula of EPSG:3031 (true at 71 S): y = 3,000 km on longitude 0 is 62.82 S; a corner lies
  // sqrt(2) farther from the pole, 52.3 S.
  CHECK(ink(footprint, -63.2, 0.0) == 80);
  CHECK(ink(footprint, -62.4, 0.0) == 0);
  CHECK(ink(footprint, -54.0, 45.0) == 80);
  CHECK(ink(footprint, -89.0, 170.0) == 80);
  CHECK(ink(footprint, 40.0, 0.0) == 0);
  bool has_line = false;
  for (double latitude = -63.2; latitude < -62.4; latitude += 0.005) has_line = has_line || ink(footprint, latitude, 0.0) == 255;
  CHECK(has_line);

  raster.transform = {10.0, 1e-5, 0.0, 50.0, 0.0, -1e-5};
  raster.crs = "EPSG:4326";
  const test::MadeFile field("field.tif", raster);
  options.path = field.path();
  const Opened small = opened(open_footprint(std::shared_ptr<const RasterSource>(*open_gdal(options, geo::kWgs84)), geo::kWgs84));
  CHECK(ink(small, 50.0 + 0.08 * 180.0 / std::numbers::pi, 10.0) == 255);
  CHECK(ink(small, 51.0, 10.0) == 0);
}

TEST_CASE("footprints: every raster of a catalogue is tinted, with lines where one begins or ends; what goes round the globe is not") {
  const auto made = [](double south, double west, double north, double east) {
    const double corners[4][2] = {{north, west}, {north, east}, {south, east}, {south, west}};
    std::vector<geo::LatLon> ring;
    for (int i = 0; i < 4 * kRingSteps; ++i) {
      const double* a = corners[i / kRingSteps];
      const double* b = corners[(i / kRingSteps + 1) % 4];
      const double t = static_cast<double>(i % kRingSteps) / kRingSteps;
      ring.push_back({to_radians(Degrees(std::lerp(a[0], b[0], t))), to_radians(Degrees(std::lerp(a[1], b[1], t)))});
    }
    return Footprint(ring, Metres(1000), geo::kWgs84);
  };
  Catalogue::Sets sets;
  for (const auto& [south, west, north, east] : {std::array{-89.0, -179.9, 89.0, 179.9}, {10.0, 20.0, 14.0, 26.0}, {12.0, 23.0, 16.0, 29.0}})
    sets.push_back(std::make_shared<const DataSet>(DataSet{static_cast<std::uint32_t>(sets.size()), "", 0, made(south, west, north, east)}));
  const auto catalogue = std::make_shared<const Catalogue>(std::move(sets), CatalogueOrder::finest, nullptr);
  const Opened drawn = opened(open_footprints(catalogue, "two", geo::kWgs84));
  const auto inks = [&](double latitude, double longitude, int width) {  // of pixels 0.011 degrees wide
    const glm::dvec2 at = pixel_of(*drawn.reader, latitude, longitude);
    const auto pixels = drawn.reader->read_colours(0, {static_cast<int>(at.x) - width / 2, static_cast<int>(at.y), width, 1});
    REQUIRE(pixels);
    std::set<int> found;
    for (int x = 0; x < width; ++x) found.insert(pixels->at(x, 0)[3]);
    return found;
  };
  using Found = std::set<int>;
  CHECK(inks(13.0, 21.0, 1) == Found{80});
  CHECK(inks(13.0, 24.5, 1) == Found{80});
  CHECK(inks(15.0, 28.0, 1) == Found{80});
  CHECK(inks(15.0, 21.0, 1) == Found{0});
  CHECK(inks(-50.0, 100.0, 1) == Found{0});
  CHECK(inks(11.0, 20.0, 21) == Found{0, 80, 255});  // the border of the first
  CHECK(inks(13.0, 23.0, 21) == Found{80, 255});     // that of the second over the first
  CHECK(inks(13.0, 22.0, 21) == Found{80});
}

TEST_CASE("debug sources: what cannot be is refused") {
  CHECK_FALSE(open_tile_index({false, 256}, geo::kMars));
  CHECK_FALSE(open_tile_index({true, 16}, geo::kWgs84));
  const Opened tiles = opened(open_tile_index({}, geo::kWgs84));
  CHECK_FALSE(tiles.reader->read_heights(0, {0, 0, 4, 4}));
}
