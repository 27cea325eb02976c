#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <doctest/doctest.h>
#include <proj.h>

#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::source;
using test::MadeFile;
using test::MadeRaster;

namespace {

std::unique_ptr<RasterSource> open(const GdalOptions& options, const geo::Ellipsoid& world = geo::kWgs84) {
  Result<std::unique_ptr<RasterSource>> source = open_gdal(options, world);
  REQUIRE_MESSAGE(source, source.error().message);
  return std::move(source).value();
}

raster::HeightGrid read_level(const RasterSource& source, int level) {
  const LevelSize size = source.description().levels[static_cast<std::size_t>(level)];
  Result<raster::HeightGrid> grid = source.open_reader().value()->read_heights(level, {0, 0, size.width, size.height});
  REQUIRE_MESSAGE(grid, grid.error().message);
  return std::move(grid).value();
}

raster::HeightGrid heights_of(const MadeRaster& made, GdalOptions options = {}, const geo::Ellipsoid& world = geo::kWgs84) {
  const MadeFile file("heights.tif", made);
  options.path = file.path();
  return read_level(*open(options, world), 0);
}

MadeRaster row_of(std::vector<double> samples, GDALDataType type) {
  return {.width = static_cast<int>(samples.size()), .height = 1, .values = {std::move(samples)}, .type = type};
}

}  // namespace

TEST_CASE("read_heights: scale, offset and unit of the band are applied, those of the options instead of them") {
  MadeRaster made = row_of({0, 100}, GDT_Int16);
  made.adjust = [](GDALDataset& d) {
    d.GetRasterBand(1)->SetScale(0.5);
    d.GetRasterBand(1)->SetOffset(7.0);
    d.GetRasterBand(1)->SetUnitType("ft");
  };
  CHECK(heights_of(made).at(1, 0) == doctest::Approx((100 * 0.5 + 7.0) * 0.3048));
  GdalOptions options;
  options.scale = 2.0;
  options.offset = -1.0;
  CHECK(heights_of(made, options).at(1, 0) == 199.0f);
}

TEST_CASE("read_heights: no-data, infinities and absurd values are voids") {
  const double infinity = std::numeric_limits<double>::infinity();
  MadeRaster made = row_of({5, -9999, infinity, std::numeric_limits<double>::quiet_NaN(), 3.4e38, -2e5, 8848}, GDT_Float32);
  made.no_data = -9999;
  const raster::HeightGrid grid = heights_of(made);
  CHECK(grid.at(0, 0) == 5.0f);
  CHECK(grid.at(6, 0) == 8848.0f);
  for (int i = 1; i <= 5; ++i) CHECK(std::isnan(grid.at(i, 0)));
  GdalOptions options;
  options.no_data = 5;
  CHECK(std::isnan(heights_of(made, options).at(0, 0)));
  CHECK(heights_of(made, options).at(1, 0) == -9999.0f);
}

TEST_CASE("read_heights: a 32-bit no-data value that no float equals exactly is still found") {
  MadeRaster made = row_of({1, static_cast<double>(-3.4028235e38f), 0.1f}, GDT_Float32);
  made.no_data = 0.1;
  CHECK(std::isnan(heights_of(made).at(2, 0)));
}

TEST_CASE("read_heights: 16-bit voids without a tag are voids") {
  const raster::HeightGrid grid = heights_of(row_of({-32768, -32767, -11000}, GDT_Int16));
  CHECK(std::isnan(grid.at(0, 0)));
  CHECK(std::isnan(grid.at(1, 0)));
  CHECK(grid.at(2, 0) == -11000.0f);
}

TEST_CASE("read_heights: distances from the body's centre become heights") {
  MadeRaster made = row_of({0, 2000}, GDT_Int16);
  made.crs = "+proj=longlat +R=1737400 +no_defs";
  made.adjust = [](GDALDataset& d) {
    d.GetRasterBand(1)->SetScale(0.5);
    d.GetRasterBand(1)->SetOffset(1737400.0);
  };
  CHECK(heights_of(made, {}, geo::kMoon).at(1, 0) == 1000.0f);
}

TEST_CASE("read_heights: craterlake's untagged voids are as many as its README says") {
  const auto path = test::shared_data("earth/regional/craterlake-elev-16bit-30m.tif");
  if (!path) return;
  const raster::HeightGrid grid = read_level(*open({.path = *path}), 0);
  CHECK(std::count_if(grid.metres.begin(), grid.metres.end(), [](float h) { return std::isnan(h); }) == 39489);
  CHECK(*std::max_element(grid.metres.begin(), grid.metres.end(), [](float a, float b) { return (std::isnan(a) ? -1e9f : a) < (std::isnan(b) ? -1e9f : b); }) == 1880.0f);
}

TEST_CASE("read_heights: the Moon's own grid and its scaled copy agree with the published extremes") {
  const auto label = test::shared_data("moon/LDEM_4.LBL");
  const auto copy = test::shared_data("moon/lola_ldem4_4ppd_scale0.5.tif");
  if (!label || !copy) return;
  const auto original = open({.path = *label}, geo::kMoon);
  const auto scaled = open({.path = *copy}, geo::kMoon);
  CHECK(original->description().wraps);
  for (const RasterSource* source : {original.get(), scaled.get()}) {
    const raster::HeightGrid grid = read_level(*source, 0);
    CHECK(*std::min_element(grid.metres.begin(), grid.metres.end()) == -8878.5f);
    CHECK(*std::max_element(grid.metres.begin(), grid.metres.end()) == 10504.0f);
    // 5.4 N, 201.4 E (the label's longitudes run from 0 to 360)
    const geo::LatLon place{to_radians(Degrees(5.375)), to_radians(Degrees(201.375))};
    glm::dvec2 pixel;
    source->open_reader().value()->to_pixels({&place, 1}, {&pixel, 1});
    CHECK(grid.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y)) > 10000.0f);
  }
}

TEST_CASE("levels: each is half of the one before, rounded up, until it fits into a block") {
  const MadeFile file("levels.tif", {.width = 1101, .height = 515, .values = {test::ramp(1101 * 515, 0, 0.001)}, .type = GDT_Float32,
                                     .transform = std::array<double, 6>{10, 0.01, 0, 50, 0, -0.01}});
  const auto source = open({.path = file.path()});
  const std::vector<LevelSize>& levels = source->description().levels;
  REQUIRE(levels.size() == 4);
  CHECK(levels[1].width == 551);
  CHECK(levels[1].height == 258);
  CHECK(levels[3].width == 138);
  // A plane stays a plane: sample (i, j) is the plane's height at the middle of its box.
  const raster::HeightGrid coarse = read_level(*source, 2);
  const glm::dvec2 step = 1.0 / level_scale(source->description(), 2);
  for (const glm::ivec2 p : {glm::ivec2(0, 0), glm::ivec2(100, 70), glm::ivec2(275, 128)}) {
    const glm::dvec2 middle = (glm::dvec2(p) + 0.5) * step - 0.5;
    CHECK(std::abs(coarse.at(p.x, p.y) - 0.001 * (middle.x + middle.y * 1101)) < 0.01);  // rows are 1.1 m apart
  }
}

TEST_CASE("levels: the file's overviews are read as they are, and voids stay out of levels that it lacks") {
  std::vector<double> samples(600 * 520, 100.0);
  for (int i = 0; i < 600 * 520; i += 2) samples[static_cast<std::size_t>(i)] = -32768;
  MadeRaster made{.width = 600, .height = 520, .values = {samples}, .transform = std::array<double, 6>{10, 0.01, 0, 50, 0, -0.01}, .no_data = -32768};
  {
    const MadeFile file("voids.tif", made);
    const raster::HeightGrid grid = read_level(*open({.path = file.path()}), 2);
    CHECK(std::all_of(grid.metres.begin(), grid.metres.end(), [](float h) { return h == 100.0f; }));
  }
  made.adjust = [](GDALDataset& d) {
    const int factor = 2;
    REQUIRE(d.BuildOverviews("NEAREST", 1, &factor, 0, nullptr, nullptr, nullptr) == CE_None);
    GDALRasterBand* overview = d.GetRasterBand(1)->GetOverview(0);
    REQUIRE(overview->Fill(77) == CE_None);
  };
  const MadeFile file("overview.tif", made);
  const auto source = open({.path = file.path()});
  CHECK(read_level(*source, 1).at(10, 10) == 77.0f);
  CHECK(read_level(*source, 2).at(10, 10) == 77.0f);  // made from the overview
  GdalOptions own{.path = file.path()};
  own.no_data = 100;  // the overview was made with another idea of voids
  CHECK(read_level(*open(own), 1).at(10, 10) == -32768.0f);
}

TEST_CASE("vertical: egm96 heights become ellipsoidal ones as PROJ's own transformation has it, near NGA's published values") {
  // 1200 x 3 samples of 0.0025 degrees round NGA's test point 38.6281550 N, 269.7791550 E: -31.628 m (EGM96, INTPT).
  const MadeRaster made{.width = 1200, .height = 3, .values = {test::ramp(3600, 0, 0)}, .transform = std::array<double, 6>{-91.0, 0.0025, 0, 38.632, 0, -0.0025}};
  GdalOptions options;
  options.vertical = "egm96";
  const raster::HeightGrid grid = heights_of(made, options);
  PJ_CONTEXT* context = proj_context_create();
  PJ* operation = proj_create_crs_to_crs(context, "EPSG:4326+5773", "EPSG:4979", nullptr);
  REQUIRE(operation != nullptr);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 1200; ++x) {
      const double lat = 38.632 - (y + 0.5) * 0.0025;
      const double lon = -91.0 + (x + 0.5) * 0.0025;
      const PJ_COORD c = proj_trans(operation, PJ_FWD, proj_coord(lat, lon, 0, HUGE_VAL));
      REQUIRE(std::abs(static_cast<double>(grid.at(x, y)) - c.xyz.z) < 0.001);
    }
  }
  proj_destroy(operation);
  proj_context_destroy(context);
  const int column = static_cast<int>((269.7791550 - 360 + 91.0) / 0.0025);
  CHECK(std::abs(grid.at(column, 1) + 31.628f) < 0.2f);
}

TEST_CASE("vertical: a compound CRS says its datum itself, and the options overrule it") {
  MadeRaster made = row_of({100, 100}, GDT_Int16);
  made.crs = "EPSG:4326+5773";
  const MadeFile file("compound.tif", made);
  const auto source = open({.path = file.path()});
  CHECK(source->description().vertical_declared);
  CHECK(source->description().vertical == "EGM96 height");
  const float raised = read_level(*source, 0).at(0, 0);
  GdalOptions options;
  options.vertical = "egm96";
  made.crs = "EPSG:4326";
  CHECK(raised == doctest::Approx(heights_of(made, options).at(0, 0)));
  options.vertical = "ellipsoid";
  CHECK(heights_of(made, options).at(0, 0) == 100.0f);
}

TEST_CASE("vertical: heights above a sphere become those above the flattened ellipsoid, declared or because they are distances from the centre") {
  MadeRaster made{.width = 36, .height = 18, .values = {std::vector<double>(648, 1000.0)}, .crs = "IAU_2015:49900", .transform = std::array<double, 6>{-180, 10, 0, 90, 0, -10}};
  // A point at the planetocentric latitude of a row's middle and 3,397,190 m from the centre; Mars' radius there is that of the ellipse through it.
  const auto expected = [](int row) {
    const double centric = (85.0 - 10.0 * row) * std::numbers::pi / 180.0;
    const double x = 3397190.0 * std::cos(centric), z = 3397190.0 * std::sin(centric);
    return geo::to_geodetic(geo::kMars, {glm::dvec3(x, 0.0, z)}).height.value;
  };
  const auto check = [&](const raster::HeightGrid& grid) {
    for (int row = 0; row < 18; ++row) CHECK(std::abs(grid.at(20, row) - expected(row)) < 0.5);  // up to 20 km along the normal leave the radius by 120 m, on ground that slopes by 0.6 %
  };
  GdalOptions options;
  options.vertical = "sphere";
  check(heights_of(made, options, geo::kMars));
  options.vertical = "sphere 3396190";
  check(heights_of(made, options, geo::kMars));
  made.adjust = [](GDALDataset& d) { d.GetRasterBand(1)->SetOffset(3396190.0); };
  check(heights_of(made, {}, geo::kMars));
  const MadeFile file("radius.tif", made);
  const auto source = open({.path = file.path()}, geo::kMars);
  CHECK(source->description().vertical == "sphere 3396190");
  CHECK(source->description().hints.empty());
  options.vertical = "sphere 1737400";
  options.path = file.path();
  const auto wrong = open_gdal(options, geo::kMars);
  REQUIRE(!wrong);
  CHECK(wrong.error().message.find("sphere 3396190") != std::string::npos);
}

TEST_CASE("vertical: heights without a datum get a hint, heights with one and colours do not") {
  const MadeFile file("undeclared.tif", row_of({1, 2}, GDT_Int16));
  const auto undeclared = open({.path = file.path()});
  CHECK(!undeclared->description().vertical_declared);
  REQUIRE(undeclared->description().hints.size() == 1);
  CHECK(undeclared->description().hints[0].find("vertical = ") != std::string::npos);
  CHECK(open({.path = file.path(), .vertical = "ellipsoid"})->description().hints.empty());
  CHECK(open({.path = file.path(), .kind = SampleKind::grey})->description().hints.empty());
}
