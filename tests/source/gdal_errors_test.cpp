#include <filesystem>
#include <fstream>

#include <doctest/doctest.h>

#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::source;
using test::MadeFile;
using test::MadeRaster;

namespace {

const MadeRaster kPlain{.width = 2, .height = 1, .values = {{1, 2}}};

/// The error of opening, which must be of this code, name the file and hold `word`.
void check_error(const GdalOptions& options, ErrorCode code, const std::string& word, const geo::Ellipsoid& world = geo::kWgs84) {
  const auto source = open_gdal(options, world);
  REQUIRE(!source);
  INFO(source.error().message);
  CHECK(source.error().code == code);
  CHECK(source.error().message.starts_with(options.path + ": "));
  CHECK(source.error().message.find(word) != std::string::npos);
  CHECK(source.error().message.find('\n') == std::string::npos);
}

void check_error(const MadeRaster& made, ErrorCode code, const std::string& word, GdalOptions options = {}, const geo::Ellipsoid& world = geo::kWgs84) {
  const MadeFile file("wrong.tif", made);
  options.path = file.path();
  check_error(options, code, word, world);
}

std::filesystem::path scratch(const std::string& name) { return std::filesystem::temp_directory_path() / ("tellurion_source_test_" + name); }

}  // namespace

TEST_CASE("open_gdal: missing files, folders and other files are told apart") {
  check_error({.path = "/nowhere/at/all.tif"}, ErrorCode::not_found, "no such file");
  check_error({.path = std::filesystem::temp_directory_path().string()}, ErrorCode::unsupported, "folder");
  const auto text = scratch("text.tif");
  std::ofstream(text) << "no raster at all";
  check_error({.path = text.string()}, ErrorCode::unsupported, "no raster format");
  std::filesystem::remove(text);
}

TEST_CASE("open_gdal: a raster without a place or a CRS says how to give it one") {
  MadeRaster made = kPlain;
  made.transform.reset();
  check_error(made, ErrorCode::unsupported, "-a_ullr");
  made = kPlain;
  made.crs.clear();
  check_error(made, ErrorCode::unsupported, "-a_srs");
  const MadeFile file("placed.tif", made);
  CHECK(open_gdal({.path = file.path(), .crs = "EPSG:4326"}, geo::kWgs84));
}

TEST_CASE("open_gdal: control points are refused with the command that straightens them") {
  MadeRaster made = kPlain;
  made.transform.reset();
  made.crs.clear();
  made.adjust = [](GDALDataset& d) {
    std::array<GDAL_GCP, 3> points;
    GDALInitGCPs(3, points.data());
    points[1].dfGCPPixel = points[1].dfGCPX = 1;
    points[2].dfGCPLine = points[2].dfGCPY = 1;
    OGRSpatialReference crs;
    crs.importFromEPSG(4326);
    REQUIRE(d.SetGCPs(3, points.data(), &crs) == CE_None);
    GDALDeinitGCPs(3, points.data());
  };
  check_error(made, ErrorCode::unsupported, "gdalwarp");
}

TEST_CASE("open_gdal: a raster of another body names both bodies") {
  check_error(kPlain, ErrorCode::invalid_argument, "Earth", {}, geo::kMars);
  check_error(kPlain, ErrorCode::invalid_argument, "Mars", {}, geo::kMars);
  MadeRaster made = kPlain;
  made.crs = "+proj=longlat +R=1737400 +no_defs";
  check_error(made, ErrorCode::invalid_argument, "the Moon");
}

TEST_CASE("open_gdal: options that make no sense are named") {
  GdalOptions options;
  options.crs = "EPSG:999999";
  check_error(kPlain, ErrorCode::invalid_argument, "EPSG:999999", options);
  options = {};
  options.vertical = "moon cheese";
  check_error(kPlain, ErrorCode::invalid_argument, "moon cheese", options);
  options.vertical = "EPSG:4326";
  check_error(kPlain, ErrorCode::invalid_argument, "EPSG:4326", options);
  options = {};
  options.rgb_bands = std::array<int, 3>{1, 2, 1};
  check_error(kPlain, ErrorCode::invalid_argument, "band 2", options);
  options = {};
  options.vertical = "egm96";
  MadeRaster moon = kPlain;
  moon.crs = "+proj=longlat +R=1737400 +no_defs";
  check_error(moon, ErrorCode::invalid_argument, "datum of the Earth", options, geo::kMoon);
}

TEST_CASE("open_gdal: a vertical datum whose grid is missing names the grid") {
  GdalOptions options;
  options.vertical = "egm2008";
  const MadeFile file("egm2008.tif", kPlain);
  options.path = file.path();
  const auto source = open_gdal(options, geo::kWgs84);
  if (source) {
    MESSAGE("skipped: the grid of egm2008 is installed here");
    return;
  }
  CHECK(source.error().code == ErrorCode::unsupported);
  CHECK(source.error().message.find("egm08") != std::string::npos);
}

TEST_CASE("open_gdal: complex samples are refused") {
  MadeRaster made = kPlain;
  made.type = GDT_CFloat32;
  check_error(made, ErrorCode::unsupported, "complex");
}

TEST_CASE("open_gdal: a geotransform without area is refused") {
  MadeRaster made = kPlain;
  made.transform = std::array<double, 6>{10, 1, 1, 50, 1, 1};
  check_error(made, ErrorCode::unsupported, "geotransform");
}

TEST_CASE("open_gdal: the network is never touched, not even through a VRT") {
  configure_gdal(64 << 20);
  GDALAllRegister();
  CHECK(GetGDALDriverManager()->GetDriverByName("WMS") == nullptr);
  CHECK(GetGDALDriverManager()->GetDriverByName("GTiff") != nullptr);
  for (const char* path : {"/vsicurl/http://127.0.0.1:9/a.tif", "http://127.0.0.1:9/a.tif", "/vsis3/bucket/a.tif"}) {
    check_error({.path = path}, ErrorCode::unsupported, "network access is off");
  }
  const auto vrt = scratch("remote.vrt");
  std::ofstream(vrt) << R"(<VRTDataset rasterXSize="2" rasterYSize="1"><SRS>EPSG:4326</SRS><GeoTransform>10,1,0,50,0,-1</GeoTransform>
    <VRTRasterBand dataType="Int16" band="1"><SimpleSource><SourceFilename>/vsicurl/http://127.0.0.1:9/a.tif</SourceFilename><SourceBand>1</SourceBand>
    <SourceProperties RasterXSize="2" RasterYSize="1" DataType="Int16" BlockXSize="2" BlockYSize="1"/>
    <SrcRect xOff="0" yOff="0" xSize="2" ySize="1"/><DstRect xOff="0" yOff="0" xSize="2" ySize="1"/></SimpleSource></VRTRasterBand></VRTDataset>)";
  const auto source = open_gdal({.path = vrt.string()}, geo::kWgs84);
  REQUIRE(source);
  const auto heights = source.value()->open_reader().value()->read_heights(0, {0, 0, 2, 1});
  REQUIRE(!heights);
  CHECK(heights.error().code == ErrorCode::corrupt);
  CHECK(heights.error().message.find("network access is off") != std::string::npos);
  std::filesystem::remove(vrt);
}

TEST_CASE("read_heights: a truncated file is an error that names it, not a crash") {
  const MadeFile whole("whole.tif", {.width = 300, .height = 300, .values = {test::ramp(90000, 0, 0.1)}, .creation_options = {"COMPRESS=DEFLATE"}});
  vsi_l_offset size = 0;
  const GByte* bytes = VSIGetMemFileBuffer(whole.path().c_str(), &size, FALSE);
  for (const double share : {0.02, 0.5, 0.9}) {
    const auto part = scratch("part.tif");
    std::ofstream(part, std::ios::binary).write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(static_cast<double>(size) * share));
    const auto source = open_gdal({.path = part.string()}, geo::kWgs84);
    const Error error = source ? source.value()->open_reader().value()->read_heights(0, {0, 0, 300, 300}).error() : source.error();
    CAPTURE(error.message);
    CHECK(error.code != ErrorCode::internal);
    CHECK(error.message.starts_with(part.string()));
    std::filesystem::remove(part);
  }
}

TEST_CASE("open_reader: a file that vanished or changed since is an error that names it") {
  const auto path = scratch("gone.tif");
  const MadeFile made("gone.tif", kPlain);
  const auto copy = [&](const MadeFile& file) {
    vsi_l_offset size = 0;
    const GByte* bytes = VSIGetMemFileBuffer(file.path().c_str(), &size, FALSE);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  };
  copy(made);
  const auto source = std::move(open_gdal({.path = path.string()}, geo::kWgs84)).value();
  const MadeFile other("other.tif", {.width = 3, .height = 1, .values = {{1, 2, 3}}});
  copy(other);
  const auto changed = source->open_reader();
  REQUIRE(!changed);
  CHECK(changed.error().code == ErrorCode::unavailable);
  CHECK(open_gdal({.path = path.string()}, geo::kWgs84).value()->revision() != source->revision());
  std::filesystem::remove(path);
  const auto gone = source->open_reader();
  REQUIRE(!gone);
  CHECK(gone.error().code == ErrorCode::not_found);
}
