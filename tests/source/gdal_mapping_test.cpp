#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::source;
using test::MadeFile;
using test::MadeRaster;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Opened {
  std::unique_ptr<RasterSource> source;
  std::unique_ptr<RasterReader> reader;

  Opened(const std::string& path, const geo::Ellipsoid& world, std::optional<std::string> crs = {}) {
    GdalOptions options;
    options.path = path;
    options.crs = std::move(crs);
    Result<std::unique_ptr<RasterSource>> opened = open_gdal(options, world);
    REQUIRE_MESSAGE(opened, opened.error().message);
    source = std::move(opened).value();
    reader = std::move(source->open_reader()).value();
  }
  const RasterDescription& about() const { return source->description(); }
  glm::dvec2 pixel(double lat, double lon) {
    const geo::LatLon place{Radians(lat * kDegree), Radians(lon * kDegree)};
    glm::dvec2 result;
    reader->to_pixels({&place, 1}, {&result, 1});
    return result;
  }
  /// Latitude and longitude in degrees.
  glm::dvec2 place(glm::dvec2 at) {
    geo::LatLon result;
    reader->to_places({&at, 1}, {&result, 1});
    return glm::dvec2(result.latitude.value, result.longitude.value) / kDegree;
  }
};

double turn(double degrees) { return degrees - 360.0 * std::round(degrees / 360.0); }

/// Compares places of random pixels with GDAL's own transformation from the file's CRS to WGS 84, and takes them back.
void check_against_gdal(const std::string& path) {
  CAPTURE(path);
  Opened raster(path, geo::kWgs84);
  GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str()));
  REQUIRE(dataset);
  std::array<double, 6> t{};
  REQUIRE(dataset->GetGeoTransform(t.data()) == CE_None);
  OGRSpatialReference wgs84;
  wgs84.importFromEPSG(4326);
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_wgs84(OGRCreateCoordinateTransformation(dataset->GetSpatialRef(), &wgs84));
  REQUIRE(to_wgs84);
  const unsigned seed = std::random_device{}();
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0.001, 0.999);
  for (int i = 0; i < 200; ++i) {
    const glm::dvec2 pixel(share(random) * dataset->GetRasterXSize(), share(random) * dataset->GetRasterYSize());
    double x = t[0] + pixel.x * t[1] + pixel.y * t[2];
    double y = t[3] + pixel.x * t[4] + pixel.y * t[5];
    REQUIRE(to_wgs84->Transform(1, &x, &y));
    const glm::dvec2 place = raster.place(pixel);
    REQUIRE(std::abs(place.x - y) < 1e-9);
    REQUIRE(std::abs(turn(place.y - x)) * std::cos(y * kDegree) < 1e-9);
    const glm::dvec2 back = raster.pixel(place.x, place.y + 360.0);  // any turn of the longitude
    REQUIRE(std::abs(back.x - pixel.x) < 1e-4);
    REQUIRE(std::abs(back.y - pixel.y) < 1e-4);
  }
}

}  // namespace

TEST_CASE("to_places and to_pixels: agree with GDAL's coordinate transformation for the real rasters") {
  for (const char* name : {"earth/elevation/etopo5.tif", "earth/elevation/arctic_polar_stereographic.tif", "earth/regional/antarctica_etopo5_epsg3031_10km.tif",
                           "earth/regional/dsm.tif", "earth/regional/naip_20170827.tif", "earth/regional/boston-inset.tif", "earth/regional/mosaic_cog1.tif",
                           "earth/regional/cog_int16_utm21n.tif", "earth/regional/mt_everest_90m.tif"}) {
    if (const auto path = test::shared_data(name)) check_against_gdal(*path);
  }
}

TEST_CASE("to_places and to_pixels: agree with GDAL for Web Mercator, NAD27, a sinusoidal CRS and a rotated geotransform") {
  MadeRaster made{.width = 20, .height = 10, .values = {test::ramp(200)}};
  const auto check = [&](const char* crs, std::array<double, 6> transform) {
    made.crs = crs;
    made.transform = transform;
    const MadeFile file("mapping.tif", made);
    check_against_gdal(file.path());
  };
  check("EPSG:3857", {-8e6, 1000, 0, 5e6, 0, -1000});
  check("EPSG:4267", {-100, 0.1, 0, 40, 0, -0.1});
  check("ESRI:54008", {-2e6, 30000, 0, 5e6, 0, -30000});
  check("EPSG:32633", {400000, 300, 120, 5000000, 80, -250});
  check("EPSG:4807", {1, 0.1, 0, 52, 0, -0.1});  // grads east of Paris
}

TEST_CASE("wraps: whole circles do, in any cylindrical CRS, and longitudes come into the raster's own range") {
  MadeRaster made{.width = 36, .height = 18, .values = {test::ramp(648)}};
  const auto check = [&](const char* crs, std::array<double, 6> transform, bool wraps, double lon, double column) {
    CAPTURE(crs);
    made.crs = crs;
    made.transform = transform;
    const MadeFile file("wraps.tif", made);
    Opened raster(file.path(), geo::kWgs84);
    CHECK(raster.about().wraps == wraps);
    CHECK(raster.pixel(0.0, lon).x == doctest::Approx(column));
  };
  check("EPSG:4326", {-180, 10, 0, 90, 0, -10}, true, 175, 35.5);
  check("EPSG:4326", {-180, 10, 0, 90, 0, -10}, true, 185, 0.5);
  check("EPSG:4326", {0, 10, 0, 90, 0, -10}, true, -175, 18.5);
  check("EPSG:4326", {170, 1, 0, 9, 0, -1}, false, -175, 15.0);     // crosses the antimeridian
  check("EPSG:4326", {-180, 9.97, 0, 90, 0, -10}, false, 0, 180 / 9.97);
  const double world = 2 * std::numbers::pi * 6378137.0;
  check("EPSG:3857", {-world / 2, world / 36, 0, world / 4, 0, -world / 36}, true, 361, 18.1);
  check("+proj=eqc +lat_ts=40 +datum=WGS84", {0, 1, 0, 9, 0, -1}, false, 0, 0);
  check("EPSG:4087", {0, world / 36, 0, world / 4, 0, -world / 36}, true, -175, 18.5);  // equirectangular, 0 to 360
}

TEST_CASE("to_places: beyond a pole there is no place, and half a pixel over it still belongs to the raster") {
  const auto path = test::shared_data("earth/elevation/etopo5.tif");
  if (!path) return;
  Opened etopo5(*path, geo::kWgs84);
  CHECK(std::isnan(etopo5.place({100, 0.0}).x));
  CHECK(etopo5.place({100, 0.5}).x == doctest::Approx(90.0));
  CHECK(etopo5.pixel(90.0, 0.0).y == doctest::Approx(0.5));
  CHECK(etopo5.pixel(-90.0, 0.0).y == doctest::Approx(2160.5));
  CHECK(etopo5.about().bounds.north.value == doctest::Approx(std::numbers::pi / 2));
  CHECK(etopo5.about().wraps);
}

TEST_CASE("to_pixels: the pole of a polar raster is where its README says") {
  const auto path = test::shared_data("earth/regional/antarctica_etopo5_epsg3031_10km.tif");
  if (!path) return;
  Opened antarctica(*path, geo::kWgs84);
  CHECK(glm::distance(antarctica.pixel(-90.0, 77.0), glm::dvec2(300.0)) < 1e-9);
  CHECK(antarctica.about().bounds.south.value == doctest::Approx(-std::numbers::pi / 2));
  CHECK(antarctica.about().bounds.east.value - antarctica.about().bounds.west.value == doctest::Approx(2 * std::numbers::pi));
  const auto grid = antarctica.reader->read_heights(0, {299, 299, 2, 2}).value();
  CHECK(grid.metres == std::vector<float>{2805, 2824, 2805, 2805});  // gdallocationinfo
}

TEST_CASE("Mars: planetocentric latitudes of a sphere become planetographic ones of the flattened world, and stay on a sphere") {
  // tan(planetographic) = (a / b)^2 tan(planetocentric), Snyder (1987), equation 3-28.
  const MadeRaster made{.width = 36, .height = 18, .values = {test::ramp(648)}, .crs = "IAU_2015:49900", .transform = std::array<double, 6>{-180, 10, 0, 90, 0, -10}};
  const MadeFile file("mars.tif", made);
  Opened flattened(file.path(), geo::kMars);
  for (const double row : {1.0, 4.5, 9.0, 13.25, 17.9}) {
    const double centric = (90.0 - 10.0 * row) * kDegree;
    const double graphic = std::atan(std::tan(centric) * (3396190.0 * 3396190.0) / (3376200.0 * 3376200.0)) / kDegree;
    CHECK(flattened.place({20.0, row}).x == doctest::Approx(graphic).epsilon(1e-12));
    CHECK(flattened.pixel(graphic, 20.0).y == doctest::Approx(row));
  }
  Opened sphere(file.path(), geo::Ellipsoid{Metres(3396190.0), Metres(3396190.0)});
  CHECK(sphere.place({20.0, 4.5}).x == doctest::Approx(45.0).epsilon(1e-12));
}

TEST_CASE("Mars: rasters in the IAU's planetographic, planetocentric, spherical and polar CRSs put one mountain at one place") {
  // The planetocentric latitude 18.0 N of the ellipsoid, east longitude 226: by PROJ (cs2cs IAU_2015:49902 IAU_2015:49901) and Snyder 3-28.
  const double graphic = std::atan(std::tan(18.0 * kDegree) * (3396190.0 * 3396190.0) / (3376200.0 * 3376200.0)) / kDegree;
  const auto row_at = [&](const char* crs, std::array<double, 6> transform) {
    const MadeFile file("mountain.tif", {.width = 360, .height = 180, .values = {test::ramp(64800)}, .crs = crs, .transform = transform});
    return Opened(file.path(), geo::kMars).pixel(graphic, 226.0);
  };
  const double metre = 3396190.0 * kDegree;
  CHECK(row_at("IAU_2015:49900", {0, 1, 0, 90, 0, -1}).y == doctest::Approx(72.0));
  CHECK(row_at("IAU_2015:49910", {-180 * metre, metre, 0, 90 * metre, 0, -metre}).y == doctest::Approx(72.0));
  CHECK(row_at("IAU_2015:49910", {-180 * metre, metre, 0, 90 * metre, 0, -metre}).x == doctest::Approx(46.0));
  const auto polar = test::shared_data("mars/mola_north_polar_stereo_10km.tif");
  if (polar) {
    Opened north(*polar, geo::kMars);
    CHECK(glm::distance(north.pixel(90.0, 10.0), glm::dvec2(180.0)) < 1e-9);
    // Polar stereographic on a sphere: distance from the pole 2 R tan((90 - latitude) / 2), planetocentric (Snyder 21-33).
    const double centric = std::atan(std::tan(70.0 * kDegree) * (3376200.0 * 3376200.0) / (3396190.0 * 3396190.0));
    const double rho = 2 * 3396190.0 * std::tan((std::numbers::pi / 2 - centric) / 2) / 10000.0;
    CHECK(glm::distance(north.pixel(70.0, 33.0), glm::dvec2(180.0)) == doctest::Approx(rho).epsilon(1e-9));
  }
}

TEST_CASE("Mars: declared geographic CRSs with planetographic latitudes and west longitudes, and with planetocentric latitudes of the ellipsoid") {
  // As Snyder 3-28 and the names of the CRSs have it: IAU_2015:49901 counts degrees to the west, IAU_2015:49902 to the east.
  const double graphic = std::atan(std::tan(18.0 * kDegree) * (3396190.0 * 3396190.0) / (3376200.0 * 3376200.0)) / kDegree;
  const MadeFile file("declared.tif", {.width = 360, .height = 180, .values = {test::ramp(64800)}, .crs = "", .transform = std::array<double, 6>{0, 1, 0, 90, 0, -1}});
  Opened west(file.path(), geo::kMars, "IAU_2015:49901");
  CHECK(west.about().wraps);
  CHECK(west.pixel(18.0, 226.0).x == doctest::Approx(134.0));
  CHECK(west.pixel(18.0, 226.0).y == doctest::Approx(72.0));
  CHECK(west.place({134.0, 72.0}).x == doctest::Approx(18.0));
  CHECK(turn(west.place({134.0, 72.0}).y - 226.0) == doctest::Approx(0.0).epsilon(1e-9));
  Opened centric(file.path(), geo::kMars, "IAU_2015:49902");
  CHECK(centric.about().wraps);
  CHECK(centric.pixel(graphic, 226.0).x == doctest::Approx(226.0));
  CHECK(centric.pixel(graphic, 226.0).y == doctest::Approx(72.0));
  CHECK(centric.place({226.0, 72.0}).x == doctest::Approx(graphic));
}

TEST_CASE("bounds: a polar raster that reaches past the equator holds its own pole, not the other one") {
  // Polar stereographic on a sphere: a corner 40,000 km from the pole in both axes lies at 90 - 2 atan(40e6 sqrt(2) / 2 R) degrees (Snyder 21-33).
  const double farthest = 90.0 - 2.0 * std::atan(40e6 * std::sqrt(2.0) / (2.0 * 3396190.0)) / kDegree;
  for (const double sign : {1.0, -1.0}) {
    for (const double mirrored : {1.0, -1.0}) {
      CAPTURE(sign);
      CAPTURE(mirrored);
      const MadeFile file("cap.tif", {.width = 80, .height = 80, .values = {test::ramp(6400)}, .crs = sign > 0 ? "IAU_2015:49930" : "IAU_2015:49935",
                                      .transform = std::array<double, 6>{-40e6 * mirrored, 1e6 * mirrored, 0, 40e6, 0, -1e6}});
      const geo::GeodeticBounds bounds = Opened(file.path(), geo::Ellipsoid{Metres(3396190.0), Metres(3396190.0)}).about().bounds;
      const double own = sign > 0 ? bounds.north.value : bounds.south.value;
      const double other = sign > 0 ? bounds.south.value : bounds.north.value;
      CHECK(own == doctest::Approx(sign * std::numbers::pi / 2));
      CHECK(other == doctest::Approx(sign * farthest * kDegree));
    }
  }
}

TEST_CASE("bounds and spacing: of real rasters as their geotransforms have them") {
  if (const auto path = test::shared_data("earth/regional/mt_everest_90m.tif")) {
    Opened everest(*path, geo::kWgs84);
    CHECK(everest.about().bounds.south.value / kDegree == doctest::Approx(28.000416666666666 - 1201 / 1200.0));
    CHECK(everest.about().bounds.west.value / kDegree == doctest::Approx(85.999583333333334));
    CHECK(everest.about().spacing.value == doctest::Approx(110774.0 / 1200).epsilon(1e-3));  // a degree of latitude at 27.5 N
  }
  const MadeFile file("across.tif", {.width = 20, .height = 2, .values = {test::ramp(40)}, .transform = std::array<double, 6>{170, 1, 0, 1, 0, -1}});
  Opened across(file.path(), geo::kWgs84);
  CHECK(across.about().bounds.west.value / kDegree == doctest::Approx(170.0));
  CHECK(across.about().bounds.east.value / kDegree == doctest::Approx(190.0));
}

namespace {

/// Every tile that holds a place of the raster must be touched, at all levels, and be no coarser there than measured.
void check_coverage(const std::string& path, const geo::Ellipsoid& world) {
  CAPTURE(path);
  Opened raster(path, world);
  const LevelSize size = raster.about().levels.front();
  const unsigned seed = std::random_device{}();
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const Coverage& coverage = raster.source->coverage();
  for (int i = 0; i < 1000; ++i) {
    glm::dvec2 pixel(share(random) * size.width, share(random) * size.height);
    if (i % 2 == 0) pixel[i / 2 % 2] = (i / 4) % 2 == 0 ? 0.0 : (i / 2 % 2 == 0 ? size.width : size.height);  // on the border
    geo::LatLon place;
    raster.reader->to_places({&pixel, 1}, {&place, 1});
    if (std::isnan(place.latitude.value)) continue;
    for (int level = 0; level <= 20; ++level) {
      const geo::TileKey tile = geo::tile_at(geo::normal_at(place), level);
      REQUIRE(coverage.touches(tile));
      REQUIRE(std::isfinite(coverage.spacing_under(tile).value));
    }
  }
}

}  // namespace

TEST_CASE("coverage: no tile that holds a place of the raster is ever missed") {
  for (const char* name : {"earth/elevation/etopo5.tif", "earth/elevation/arctic_polar_stereographic.tif", "earth/regional/antarctica_etopo5_epsg3031_10km.tif",
                           "earth/regional/dsm.tif", "earth/regional/mt_rainier_90m.tif", "earth/regional/cog_int16_utm21n.tif"}) {
    if (const auto path = test::shared_data(name)) check_coverage(*path, geo::kWgs84);
  }
  if (const auto path = test::shared_data("mars/cog_hirise_mars.tif")) check_coverage(*path, geo::kMars);
  const MadeFile across("across.tif", {.width = 200, .height = 2, .values = {test::ramp(400)}, .transform = std::array<double, 6>{90, 0.9, 0, 1, 0, -0.9}});
  check_coverage(across.path(), geo::kWgs84);
  const MadeFile sinusoidal("sinusoidal.tif", {.width = 40, .height = 20, .values = {test::ramp(800)}, .crs = "ESRI:54008",
                                               .transform = std::array<double, 6>{-20037508, 1001875, 0, 10018754, 0, -1001875}});
  check_coverage(sinusoidal.path(), geo::kWgs84);
}

TEST_CASE("coverage: tiles well outside are not touched, and a pole of an equirectangular raster is no finer than its meridians") {
  if (const auto path = test::shared_data("earth/regional/mt_rainier_90m.tif")) {
    Opened rainier(*path, geo::kWgs84);
    const auto tile_of = [](double lat, double lon, int level) {
      return geo::tile_at(geo::normal_at({Radians(lat * kDegree), Radians(lon * kDegree)}), level);
    };
    const Coverage& coverage = rainier.source->coverage();
    CHECK(coverage.touches(tile_of(46.5, -121.5, 10)));
    CHECK(!coverage.touches(tile_of(46.5, -122.5, 9)));
    CHECK(!coverage.touches(tile_of(-46.5, 58.5, 3)));
    CHECK(std::isinf(coverage.spacing_under(tile_of(0.0, 0.0, 4)).value));
    CHECK(coverage.spacing_under(tile_of(46.5, -121.5, 10)).value == doctest::Approx(92.63).epsilon(0.001));
  }
  if (const auto path = test::shared_data("earth/elevation/etopo5.tif")) {
    Opened etopo5(*path, geo::kWgs84);
    const geo::TileKey pole = geo::tile_at(geo::normal_at({Radians(89.9 * kDegree), Radians(0.3)}), 8);
    CHECK(etopo5.source->coverage().spacing_under(pole).value == doctest::Approx(111694.0 / 12).epsilon(1e-3));  // a degree at 90 N
  }
}
