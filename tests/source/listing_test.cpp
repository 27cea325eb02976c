#include "source/catalogue/listing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include "source/catalogue/footprint.h"
#include "source/catalogue/list_maker.h"
#include "source/catalogue/stac_list.h"
#include "source/catalogue/vrt_mosaic.h"
#include "source/made_archive.h"

using namespace tellurion;
using namespace tellurion::source;
using test::Folder;
using test::write_file;
namespace fs = std::filesystem;

namespace {

constexpr double kToDegrees = 180.0 / std::numbers::pi;
using Transform = std::array<double, 6>;

/// A GeoTIFF of zeroes on the disk.
void make_tiff(const fs::path& file, int width, int height, const std::string& crs, Transform transform, int bands = 1) {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(file.c_str(), width, height, bands, GDT_Byte, nullptr));
  REQUIRE(dataset);
  REQUIRE(dataset->SetGeoTransform(transform.data()) == CE_None);
  OGRSpatialReference reference;
  REQUIRE(reference.SetFromUserInput(crs.c_str()) == OGRERR_NONE);
  reference.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  REQUIRE(dataset->SetSpatialRef(&reference) == CE_None);
}

/// Runs one of GDAL's programs within `folder`.
void run(const fs::path& folder, const std::string& command) {
  CAPTURE(command);
  REQUIRE(std::system(fmt::format("cd '{}' && {} > run.log 2>&1", folder.string(), command).c_str()) == 0);
}

RasterList listed(const fs::path& path, const geo::Ellipsoid& world = geo::kWgs84) {
  auto list = list_rasters(path, world);
  REQUIRE_MESSAGE(list, list.error().message);
  return std::move(list).value();
}

void check_error(const Result<RasterList>& list, ErrorCode code, const std::string& part) {
  REQUIRE_FALSE(list);
  CAPTURE(list.error().message);
  CHECK(name_of(list.error().code) == std::string(name_of(code)));
  CHECK(list.error().message.find(part) != std::string::npos);
}

std::vector<glm::dvec2> degrees_of(const std::vector<geo::LatLon>& ring) {
  std::vector<glm::dvec2> degrees;
  degrees.reserve(ring.size());
  for (const geo::LatLon& p : ring) degrees.push_back(glm::dvec2(p.longitude.value, p.latitude.value) * kToDegrees);
  return degrees;
}

/// Corners of a raster in its CRS, once round.
std::vector<glm::dvec2> corners_of(const Transform& t, double width, double height) {
  std::vector<glm::dvec2> corners;
  for (const glm::dvec2 p : {glm::dvec2(0, 0), glm::dvec2(width, 0), glm::dvec2(width, height), glm::dvec2(0, height)})
    corners.emplace_back(t[0] + p.x * t[1] + p.y * t[2], t[3] + p.x * t[4] + p.y * t[5]);
  return corners;
}

/// The ring is that round `corners` in `crs` with `steps` an edge, as GDAL's own transformation has it, whichever corner and way round it
/// begins with; and without jumps.
void check_ring(const std::vector<geo::LatLon>& ring, std::vector<glm::dvec2> corners, const std::string& crs, int steps = kRingSteps) {
  const std::vector<glm::dvec2> found = degrees_of(ring);
  REQUIRE(found.size() == corners.size() * static_cast<std::size_t>(steps));
  for (std::size_t i = 1; i < found.size(); ++i) REQUIRE(std::abs(found[i].x - found[i - 1].x) <= 180.0);
  OGRSpatialReference from, to;
  REQUIRE(from.SetFromUserInput(crs.c_str()) == OGRERR_NONE);
  REQUIRE(to.importFromEPSG(4326) == OGRERR_NONE);
  from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  to.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> transformation(OGRCreateCoordinateTransformation(&from, &to));
  REQUIRE(transformation);
  double least = 1e9;
  for (int way = 0; way < 2; ++way) {
    for (std::size_t first = 0; first < corners.size(); ++first) {
      double most = 0.0;
      for (std::size_t i = 0; i < found.size(); ++i) {
        const std::size_t edge = i / static_cast<std::size_t>(steps);
        glm::dvec2 p = glm::mix(corners[(first + edge) % corners.size()], corners[(first + edge + 1) % corners.size()],
                                static_cast<double>(i % static_cast<std::size_t>(steps)) / steps);
        REQUIRE(transformation->Transform(1, &p.x, &p.y));
        const double east = found[i].x - p.x;
        most = std::max({most, std::abs(found[i].y - p.y), std::abs(east - 360.0 * std::round(east / 360.0))});
      }
      least = std::min(least, most);
    }
    std::reverse(corners.begin(), corners.end());
  }
  CHECK(least < 1e-6);
}

/// West, south, east and north in degrees.
std::array<double, 4> bounds_of(const std::vector<geo::LatLon>& ring) {
  REQUIRE_FALSE(ring.empty());
  glm::dvec2 lower(1e9), upper(-1e9);
  for (const glm::dvec2& p : degrees_of(ring)) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  return {lower.x, lower.y, upper.x, upper.y};
}

void check_bounds(const std::vector<geo::LatLon>& ring, const std::array<double, 4>& wanted, double within = 1e-9) {
  const std::array<double, 4> found = bounds_of(ring);
  for (std::size_t i = 0; i < 4; ++i) {
    CAPTURE(i);
    CHECK(std::abs(found[i] - wanted[i]) < within);
  }
}

const ListedRaster& raster_named(const RasterList& list, const std::string& name) {
  const auto found = std::ranges::find_if(list.rasters, [&](const ListedRaster& r) { return fs::path(r.path).filename() == name; });
  REQUIRE_MESSAGE(found != list.rasters.end(), name);
  return *found;
}

std::vector<std::string> names_of(const RasterList& list) {
  std::vector<std::string> names;
  for (const ListedRaster& raster : list.rasters) names.push_back(fs::path(raster.path).filename().string());
  return names;
}

using Names = std::vector<std::string>;

const Transform kCoarse{500000, 10, 0, 4600000, 0, -10};
const Transform kFine{500300, 5, 0, 4600000, 0, -5};

}  // namespace

// --- VRTs ------------------------------------------------------------------------------------------------------------

TEST_CASE("list_rasters: a VRT of gdalbuildvrt lists each file once, with its ring and its own spacing") {
  const Folder folder("list_vrt");
  make_tiff(folder / "b.tif", 30, 20, "EPSG:32631", kCoarse, 3);
  make_tiff(folder / "a.tif", 60, 40, "EPSG:32631", kFine, 3);
  fs::create_directories(folder / "lists");
  run(folder / "lists", "gdalbuildvrt all.vrt ../b.tif ../a.tif");
  const RasterList list = listed(folder / "lists/all.vrt");
  CHECK(list.problems.empty());
  CHECK(names_of(list) == Names{"b.tif", "a.tif"});
  CHECK(list.rasters[0].path == (folder / "b.tif").string());
  check_ring(list.rasters[0].ring, corners_of(kCoarse, 30, 20), "EPSG:32631");
  check_ring(list.rasters[1].ring, corners_of(kFine, 60, 40), "EPSG:32631");
  // UTM's scale on its meridian is 0.9996.
  CHECK(list.rasters[0].spacing.value == doctest::Approx(10 / 0.9996).epsilon(1e-3));
  CHECK(list.rasters[1].spacing.value == doctest::Approx(5 / 0.9996).epsilon(1e-3));
}

TEST_CASE("list_rasters: the parts of a VRT that show a file's middle only lie where it is shown") {
  const Folder folder("list_vrt_cut");
  make_tiff(folder / "a.tif", 30, 20, "EPSG:32631", kCoarse);
  run(folder / "", "gdalbuildvrt -te 500100 4599900 500200 4599950 -tr 20 20 -tap cut.vrt a.tif");
  const RasterList list = listed(folder / "cut.vrt");
  REQUIRE(list.rasters.size() == 1);
  GDALDatasetUniquePtr vrt(GDALDataset::Open((folder / "cut.vrt").c_str()));
  Transform t{};
  REQUIRE(vrt->GetGeoTransform(t.data()) == CE_None);
  CHECK(t[1] == 20.0);
  check_ring(list.rasters[0].ring, corners_of(t, vrt->GetRasterXSize(), vrt->GetRasterYSize()), "EPSG:32631");
  CHECK(list.rasters[0].spacing.value == doctest::Approx(10 / 0.9996).epsilon(1e-3));
}

TEST_CASE("list_rasters: a VRT within a VRT is a raster; paths with dots and whole paths are whole and plain") {
  const Folder folder("list_vrt_nested");
  fs::create_directories(folder / "sub/deep");
  make_tiff(folder / "sub/a & b.tif", 30, 20, "EPSG:32631", kCoarse);
  run(folder / "sub/deep", "gdalbuildvrt inner.vrt '../a & b.tif'");
  run(folder / "", "gdalbuildvrt outer.vrt sub/deep/inner.vrt");
  CHECK(listed(folder / "sub/deep/inner.vrt").rasters[0].path == (folder / "sub/a & b.tif").string());
  CHECK(listed(folder / "outer.vrt").rasters[0].path == (folder / "sub/deep/inner.vrt").string());
  // What gdalbuildvrt does not write relative to the VRT counts from where the programs run.
  run(folder / "", fmt::format("gdalbuildvrt sub/whole.vrt '{}' && gdalbuildvrt sub/from_here.vrt outer.vrt && grep relativeToVRT=.0 sub/from_here.vrt",
                               (folder / "sub/a & b.tif").string()));
  CHECK(listed(folder / "sub/whole.vrt").rasters[0].path == (folder / "sub/a & b.tif").string());
  const auto before = fs::current_path();
  fs::current_path(folder / "");
  CHECK(listed(folder / "sub/from_here.vrt").rasters[0].path == (folder / "outer.vrt").string());
  fs::current_path(before);
}

TEST_CASE("list_rasters: a VRT of degrees across the antimeridian, and of a CRS that PROJ has to work for") {
  const Folder folder("list_vrt_meridian");
  const Transform degrees{179, 0.01, 0, -16, 0, -0.01}, utm{100000, 100, 0, 8200000, 0, -100}, polar{-200000, 1000, 0, 150000, 0, -1000};
  make_tiff(folder / "degrees.tif", 200, 100, "EPSG:4326", degrees);
  make_tiff(folder / "utm.tif", 1000, 500, "EPSG:32701", utm);
  make_tiff(folder / "polar.tif", 400, 300, "EPSG:3413", polar);
  for (const char* name : {"degrees", "utm", "polar"}) run(folder / "", fmt::format("gdalbuildvrt {0}.vrt {0}.tif", name));
  const RasterList of_degrees = listed(folder / "degrees.vrt");
  check_ring(of_degrees.rasters[0].ring, corners_of(degrees, 200, 100), "EPSG:4326");
  CHECK(bounds_of(of_degrees.rasters[0].ring)[2] - bounds_of(of_degrees.rasters[0].ring)[0] == doctest::Approx(2.0));
  // A hundredth of a degree of latitude at 16.5 degrees south: the meridian arc of WGS 84 there is 110.66 km a degree.
  CHECK(of_degrees.rasters[0].spacing.value == doctest::Approx(1106.6).epsilon(1e-3));
  check_ring(listed(folder / "utm.vrt").rasters[0].ring, corners_of(utm, 1000, 500), "EPSG:32701");
  check_ring(listed(folder / "polar.vrt").rasters[0].ring, corners_of(polar, 400, 300), "EPSG:3413");  // round the pole
}

namespace {

/// A VRT of two parts of 20 x 30 pixels each; what is in braces is filled in.
std::string vrt_text(const std::string& sources, const std::string& attributes = R"(rasterXSize="40" rasterYSize="30")",
                     const std::string& georeference = "<SRS>EPSG:32631</SRS><GeoTransform>500000, 8, 3, 4600000, 2, -9</GeoTransform>",
                     const std::string& band = R"(dataType="Byte" band="1")") {
  return fmt::format("<VRTDataset {}>{}<VRTRasterBand {}>{}</VRTRasterBand></VRTDataset>", attributes, georeference, band, sources);
}

std::string vrt_source(const std::string& file, const std::string& rectangles, const std::string& kind = "SimpleSource") {
  return fmt::format("<{0}><SourceFilename relativeToVRT=\"1\">{1}</SourceFilename><SourceBand>1</SourceBand>{2}</{0}>", kind, file, rectangles);
}

std::string rectangle(const std::string& name, double x, double y, double width, double height) {
  return fmt::format(R"(<{} xOff="{}" yOff="{}" xSize="{}" ySize="{}"/>)", name, x, y, width, height);
}

}  // namespace

TEST_CASE("list_rasters: a turned VRT, sources of all kinds, a file with several places, masks and comments") {
  const Folder folder("list_vrt_written");
  const Transform t{500000, 8, 3, 4600000, 2, -9};
  std::string sources;
  for (const char* kind : {"SimpleSource", "ComplexSource", "AveragedSource", "KernelFilteredSource", "NoDataFromMaskSource"})
    sources += vrt_source(fmt::format("{}.tif", kind), rectangle("SrcRect", 0, 0, 40, 15) + rectangle("DstRect", 20, 0, 20, 30), kind);
  sources += vrt_source("twice.tif", rectangle("SrcRect", 0, 0, 10, 30) + rectangle("DstRect", 0, 0, 10, 30)) +
             vrt_source("twice.tif", rectangle("SrcRect", 10, 0, 10, 30) + rectangle("DstRect", 30, 10, 5, 5)) +
             "<!-- " + vrt_source("gone.tif", "") + " --><MaskBand><VRTRasterBand dataType=\"Byte\">" + vrt_source("mask.tif", "") + "</VRTRasterBand></MaskBand>" +
             vrt_source("https://host/c.tif?key=1", "") + vrt_source("/vsicurl/https://host/d.tif", "");
  write_file(folder / "a.vrt", vrt_text(sources));
  const RasterList list = listed(folder / "a.vrt");
  CHECK(list.problems.empty());
  CHECK(names_of(list) == Names{"SimpleSource.tif", "ComplexSource.tif", "AveragedSource.tif", "KernelFilteredSource.tif", "NoDataFromMaskSource.tif", "twice.tif",
                                "c.tif?key=1", "d.tif"});
  CHECK(list.rasters[6].path == "https://host/c.tif?key=1");
  CHECK(list.rasters[7].path == "https://host/d.tif");
  const auto corners_within = [&](double x0, double y0, double x1, double y1) {
    std::vector<glm::dvec2> corners;
    for (const glm::dvec2 p : {glm::dvec2(x0, y0), glm::dvec2(x1, y0), glm::dvec2(x1, y1), glm::dvec2(x0, y1)})
      corners.emplace_back(t[0] + p.x * t[1] + p.y * t[2], t[3] + p.x * t[4] + p.y * t[5]);
    return corners;
  };
  for (std::size_t i = 0; i < 5; ++i) {
    check_ring(list.rasters[i].ring, corners_within(20, 0, 40, 30), "EPSG:32631");
    // A pixel of the file is half a pixel of the VRT wide, hypot(8, 2) / 2 m, and two of its pixels high, 2 hypot(3, 9) m.
    CHECK(list.rasters[i].spacing.value == doctest::Approx(2 * std::hypot(3, 9) / 0.9996).epsilon(1e-3));
  }
  check_ring(list.rasters[5].ring, corners_within(0, 0, 35, 30), "EPSG:32631");
  CHECK(list.rasters[5].spacing.value == doctest::Approx(std::hypot(8, 2) / 2 / 0.9996).epsilon(1e-3));  // of the smaller place
  check_ring(list.rasters[6].ring, corners_within(0, 0, 40, 30), "EPSG:32631");
  CHECK(list.rasters[6].spacing.value == 0.0);  // nothing tells the file's size
}

TEST_CASE("list_rasters: the spacing is that where the file lies") {
  const Folder folder("list_vrt_mercator");
  // From 60 degrees north to the equator, where Web Mercator's pixels of 1 km are twice as wide on the ground.
  write_file(folder / "a.vrt", vrt_text(vrt_source("north.tif", rectangle("SrcRect", 0, 0, 10, 10) + rectangle("DstRect", 0, 0, 10, 10)) +
                                            vrt_source("south.tif", rectangle("SrcRect", 0, 0, 10, 10) + rectangle("DstRect", 0, 8390, 10, 10)),
                                        R"(rasterXSize="10" rasterYSize="8400")", "<SRS>EPSG:3857</SRS><GeoTransform>0, 1000, 0, 8399737.89, 0, -1000</GeoTransform>"));
  const RasterList list = listed(folder / "a.vrt");
  REQUIRE(list.rasters.size() == 2);
  CHECK(list.rasters[0].spacing.value == doctest::Approx(500).epsilon(0.01));
  CHECK(list.rasters[1].spacing.value == doctest::Approx(1000).epsilon(0.01));
}

TEST_CASE("list_rasters: what a VRT does not tell is left open") {
  const Folder folder("list_vrt_untold");
  const std::string source = vrt_source("a.tif", rectangle("SrcRect", 0, 0, 40, 30) + rectangle("DstRect", 0, 0, 40, 30));
  for (const char* georeference : {"", "<SRS>EPSG:4326</SRS>", "<GeoTransform>1, 2, 0, 3, 0, -2</GeoTransform>", "<SRS>EPSG:4326</SRS><GeoTransform>1, 2, 0</GeoTransform>",
                                   "<SRS>EPSG:4326</SRS><GeoTransform>1, nan, 0, 3, 0, -2</GeoTransform>", "<SRS>LOCAL_CS[\"x\"]</SRS><GeoTransform>1, 2, 0, 3, 0, -2</GeoTransform>",
                                   "<SRS>EPSG:4326</SRS><GeoTransform>1, 2, 0, 300, 0, -2</GeoTransform>"}) {
    CAPTURE(georeference);
    write_file(folder / "a.vrt", vrt_text(source, R"(rasterXSize="40" rasterYSize="30")", georeference));
    const RasterList list = listed(folder / "a.vrt");
    REQUIRE(list.rasters.size() == 1);
    CHECK(list.rasters[0].path == (folder / "a.tif").string());
    CHECK(list.rasters[0].ring.empty());
    CHECK(list.rasters[0].spacing.value == 0.0);
  }
}

TEST_CASE("list_rasters: VRTs that compute their pixels or have no sources are rasters, no lists") {
  const Folder folder("list_vrt_no_list");
  make_tiff(folder / "a.tif", 30, 20, "EPSG:32631", kCoarse);
  run(folder / "", "gdalwarp -of VRT -t_srs EPSG:4326 a.tif warped.vrt");
  check_error(list_rasters(folder / "warped.vrt", geo::kWgs84), ErrorCode::unsupported, "\"gdal\"");
  const std::string source = vrt_source("a.tif", "");
  write_file(folder / "derived.vrt", vrt_text(source, R"(rasterXSize="4" rasterYSize="3")", "", R"(dataType="Byte" band="1" subClass="VRTDerivedRasterBand")"));
  check_error(list_rasters(folder / "derived.vrt", geo::kWgs84), ErrorCode::unsupported, "VRTDerivedRasterBand");
  write_file(folder / "sharpened.vrt", vrt_text(source, R"(rasterXSize="4" rasterYSize="3" subClass="VRTPansharpenedDataset")"));
  check_error(list_rasters(folder / "sharpened.vrt", geo::kWgs84), ErrorCode::unsupported, "\"gdal\"");
  write_file(folder / "empty.vrt", vrt_text(""));
  check_error(list_rasters(folder / "empty.vrt", geo::kWgs84), ErrorCode::unsupported, "\"gdal\"");
}

TEST_CASE("list_rasters: wrong VRTs are refused with their names, wrong sources left out with theirs") {
  const Folder folder("list_vrt_wrong");
  const std::string right = vrt_text(vrt_source("a.tif", rectangle("DstRect", 0, 0, 5, 5)));
  REQUIRE(parse_vrt(right, "/f", "a.vrt"));
  for (std::size_t length = 0; length < right.size(); ++length) REQUIRE_FALSE(parse_vrt(right.substr(0, length), "/f", "a.vrt"));
  const auto check_corrupt = [&](const std::string& text, ErrorCode code = ErrorCode::corrupt) {
    write_file(folder / "wrong.vrt", text);
    check_error(list_rasters(folder / "wrong.vrt", geo::kWgs84), code, "wrong.vrt");
  };
  check_corrupt("");
  check_corrupt("<html><body>Not found</body></html>");
  check_corrupt(R"(<OtherDataset rasterXSize="1" rasterYSize="1"/>)");
  check_corrupt(vrt_text(vrt_source("a.tif", ""), R"(rasterXSize="0" rasterYSize="3")"));
  check_corrupt(vrt_text(vrt_source("a.tif", ""), R"(rasterXSize="1e99" rasterYSize="3")"));
  check_corrupt(vrt_text(vrt_source("a.tif", ""), R"(rasterXSize="4" rasterYSize="3")", "<SRS>nonsense</SRS><GeoTransform>1, 2, 0, 3, 0, -2</GeoTransform>"));
  check_corrupt(vrt_text(vrt_source("a.tif", ""), R"(rasterXSize="4" rasterYSize="3")", "<SRS>EPSG:4326</SRS><GeoTransform>1, 0, 0, 3, 0, 0</GeoTransform>"), ErrorCode::unsupported);
  check_corrupt(vrt_text(vrt_source("a.tif", ""), R"(rasterXSize="4" rasterYSize="3")", "<SRS>+proj=longlat +R=1737400 +no_defs</SRS><GeoTransform>1, 1, 0, 3, 0, -1</GeoTransform>"),
                ErrorCode::invalid_argument);  // the Moon's

  const std::string wrong_sources = vrt_source("inside_out.tif", rectangle("DstRect", 0, 0, -5, 5)) +
                                    vrt_source("no_number.tif", R"(<DstRect xOff="nan" yOff="0" xSize="1" ySize="1"/>)") +
                                    vrt_source("half.tif", R"(<SrcRect xOff="0" yOff="0"/>)") + vrt_source("", "") + "<SimpleSource/>" +
                                    "<SimpleSource><SourceFilename>cut.tif</SourceFilename><</SimpleSource>" + vrt_source("NETCDF:part.nc:height", "") + vrt_source("right.tif", "");
  write_file(folder / "a.vrt", vrt_text(wrong_sources));
  const RasterList list = listed(folder / "a.vrt");
  CHECK(names_of(list) == Names{"right.tif"});
  REQUIRE(list.problems.size() == 7);
  for (const std::string& problem : list.problems) CHECK(problem.find("a.vrt") != std::string::npos);
  CHECK(list.problems[0].find("inside_out.tif") != std::string::npos);
  CHECK(list.problems[1].find("no_number.tif") != std::string::npos);
  CHECK(list.problems[2].find("half.tif") != std::string::npos);

  std::string many;
  for (int i = 0; i < 250; ++i) many += "<SimpleSource/>";
  write_file(folder / "many.vrt", vrt_text(many));
  const RasterList none = listed(folder / "many.vrt");
  CHECK(none.problems.size() == ListMaker::kMostProblems + 1);
  CHECK(none.problems.back().find("150 more") != std::string::npos);
}

// --- Vector files of gdaltindex --------------------------------------------------------------------------------------

TEST_CASE("list_rasters: an index of gdaltindex, in several formats and CRSs") {
  const Folder folder("list_index");
  const Transform coarse{500000, 1000, 0, 4600000, 0, -1000}, fine{700000, 500, 0, 4600000, 0, -500};
  make_tiff(folder / "b.tif", 30, 20, "EPSG:32631", coarse);
  make_tiff(folder / "a.tif", 60, 40, "EPSG:32631", fine);
  fs::create_directories(folder / "lists");
  const std::string in_utm = "EPSG:32631";
  for (const std::string format : {"GPKG i.gpkg", "\"ESRI Shapefile\" i.shp", "FlatGeobuf -lyr_name i i.fgb"}) {
    CAPTURE(format);
    const std::string file = format.substr(format.rfind(' ') + 1);
    run(folder / "lists", fmt::format("gdaltindex -f {} ../b.tif ../a.tif", format));
    const RasterList list = listed(folder / "lists" / file);
    CHECK(list.problems.empty());
    REQUIRE(list.rasters.size() == 2);
    const ListedRaster& b = raster_named(list, "b.tif");
    CHECK(b.path == (folder / "b.tif").string());
    CHECK(b.spacing.value == 0.0);
    check_ring(b.ring, corners_of(coarse, 30, 20), in_utm);
    check_ring(raster_named(list, "a.tif").ring, corners_of(fine, 60, 40), in_utm);
  }
  // In a CRS of degrees with the latitude first, and one of metres, edges are straight there.
  const std::array<std::pair<const char*, const char*>, 2> others{{{"EPSG:4326", "degrees.gpkg"}, {"EPSG:3857", "web.shp"}}};
  for (const auto& other : others) {
    const std::string crs = other.first, file = other.second;
    CAPTURE(crs);
    run(folder / "lists", fmt::format("gdaltindex -tileindex filename -t_srs {} -f {} {} ../b.tif", crs, fs::path(file).extension() == ".shp" ? "\"ESRI Shapefile\"" : "GPKG", file));
    const RasterList list = listed(folder / "lists" / file);
    REQUIRE(list.rasters.size() == 1);
    OGRSpatialReference from, to;
    REQUIRE(from.SetFromUserInput("EPSG:32631") == OGRERR_NONE);
    REQUIRE(to.SetFromUserInput(crs.c_str()) == OGRERR_NONE);
    to.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const std::unique_ptr<OGRCoordinateTransformation> transformation(OGRCreateCoordinateTransformation(&from, &to));
    std::vector<glm::dvec2> corners = corners_of(coarse, 30, 20);
    for (glm::dvec2& corner : corners) REQUIRE(transformation->Transform(1, &corner.x, &corner.y));
    check_ring(list.rasters[0].ring, corners, crs);
  }
  // GeoJSON whose features are no STAC items.
  run(folder / "lists", "gdaltindex -f GeoJSON -t_srs EPSG:4326 i.geojson ../a.tif");
  const RasterList json = listed(folder / "lists/i.geojson");
  CHECK(names_of(json) == Names{"a.tif"});
  CHECK(json.rasters[0].ring.size() == 32);
}

namespace {

/// A GeoPackage with a feature for each WKT; an empty one has no geometry.
void make_index(const fs::path& file, const std::string& crs, const std::vector<std::string>& shapes, const char* field = "location") {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GPKG")->Create(file.c_str(), 0, 0, 0, GDT_Unknown, nullptr));
  REQUIRE(dataset);
  OGRSpatialReference reference;
  if (!crs.empty()) REQUIRE(reference.SetFromUserInput(crs.c_str()) == OGRERR_NONE);
  reference.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRLayer* layer = dataset->CreateLayer("index", crs.empty() ? nullptr : &reference, wkbUnknown);
  REQUIRE(layer);
  OGRFieldDefn definition(field, OFTString);
  REQUIRE(layer->CreateField(&definition) == OGRERR_NONE);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    OGRFeatureUniquePtr feature(OGRFeature::CreateFeature(layer->GetLayerDefn()));
    feature->SetField(field, fmt::format("{}.tif", i).c_str());
    if (!shapes[i].empty()) {
      OGRGeometry* shape = nullptr;
      REQUIRE_MESSAGE(OGRGeometryFactory::createFromWkt(shapes[i].c_str(), nullptr, &shape) == OGRERR_NONE, shapes[i]);
      feature->SetGeometryDirectly(shape);
    }
    REQUIRE(layer->CreateFeature(feature.get()) == OGRERR_NONE);
  }
}

/// A regular polygon round (10, 20).
std::string polygon_of(int corners) {
  std::string text = "POLYGON ((";
  for (int i = 0; i <= corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i % corners) / corners;
    text += fmt::format("{}{:.17g} {:.17g}", i > 0 ? "," : "", 10.0 + std::cos(angle), 20.0 + std::sin(angle));
  }
  return text + "))";
}

}  // namespace

TEST_CASE("list_rasters: an index's polygons of all kinds; what cannot be a ring is left open") {
  const Folder folder("list_index_shapes");
  make_index(folder / "i.gpkg", "EPSG:4326",
             {"POLYGON ((1 2, 5 2, 1 6, 1 2), (1.5 2.5, 2 2.5, 1.5 3, 1.5 2.5))",
              "MULTIPOLYGON (((1 2, 3 2, 3 4, 1 4, 1 2)), ((7 8, 9 8, 9 10, 7 10, 7 8)))",
              "MULTIPOLYGON (((178 -5, 180 -5, 180 5, 178 5, 178 -5)), ((-180 -5, -177 -5, -177 5, -180 5, -180 -5)))",
              polygon_of(40), polygon_of(300),
              "POLYGON ((179 10, -179 10, -179 11, 179 11, 179 10))",
              "POLYGON ((-180 -90, 180 -90, 180 90, -180 90, -180 -90))",
              "", "POINT (1 2)", "POLYGON EMPTY", "POLYGON ((1 2, 3 4, 1 2, 1 2))", "POLYGON ((1 2, 3 2, 3 95, 1 2))",
              "CURVEPOLYGON (CIRCULARSTRING (9 20, 10 21, 11 20, 10 19, 9 20))"});
  const RasterList list = listed(folder / "i.gpkg");
  CHECK(list.problems.empty());
  REQUIRE(list.rasters.size() == 13);
  check_ring(list.rasters[0].ring, {{1, 2}, {5, 2}, {1, 6}}, "EPSG:4326");
  check_ring(list.rasters[1].ring, {{1, 2}, {9, 2}, {9, 10}, {1, 10}}, "EPSG:4326");
  check_ring(list.rasters[2].ring, {{178, -5}, {183, -5}, {183, 5}, {178, 5}}, "EPSG:4326");
  CHECK(list.rasters[3].ring.size() == 80);
  check_bounds(list.rasters[3].ring, {9, 19, 11, 21});
  check_ring(list.rasters[4].ring, {{9, 19}, {11, 19}, {11, 21}, {9, 21}}, "EPSG:4326");
  CHECK(list.rasters[5].ring.empty());  // across the antimeridian, or nearly round the world
  CHECK(list.rasters[6].ring.size() == 32);
  for (std::size_t i = 7; i <= 11; ++i) {
    CAPTURE(i);
    CHECK(list.rasters[i].ring.empty());
  }
  check_bounds(list.rasters[12].ring, {9, 19, 11, 21}, 1e-3);  // GDAL puts chords of four degrees for the arcs
}

TEST_CASE("list_rasters: an index without a CRS, without names, of another body, without the field, or that is none") {
  const Folder folder("list_index_wrong");
  const std::string square = "POLYGON ((1 2, 3 2, 3 4, 1 4, 1 2))";
  make_index(folder / "no_crs.gpkg", "", {square});
  CHECK(listed(folder / "no_crs.gpkg").rasters[0].ring.empty());
  make_index(folder / "moon.gpkg", "+proj=longlat +R=1737400 +no_defs +type=crs", {square});
  check_error(list_rasters(folder / "moon.gpkg", geo::kWgs84), ErrorCode::invalid_argument, "moon.gpkg");
  check_ring(listed(folder / "moon.gpkg", geo::kMoon).rasters[0].ring, {{1, 2}, {3, 2}, {3, 4}, {1, 4}}, "EPSG:4326");
  make_index(folder / "other.gpkg", "EPSG:4326", {square}, "title");
  check_error(list_rasters(folder / "other.gpkg", geo::kWgs84), ErrorCode::unsupported, "location");
  make_index(folder / "path.gpkg", "EPSG:4326", {square}, "PATH");
  CHECK(names_of(listed(folder / "path.gpkg")) == Names{"0.tif"});

  write_file(folder / "names.csv", "location,more\n\"a, b.tif\",1\n,2\n/c.tif,3\nhttps://host/d.tif,4\n");
  const RasterList names = listed(folder / "names.csv");
  REQUIRE(names.rasters.size() == 3);
  CHECK(names.rasters[0].path == (folder / "a, b.tif").string());
  CHECK(names.rasters[1].path == "/c.tif");
  CHECK(names.rasters[2].path == "https://host/d.tif");
  REQUIRE(names.problems.size() == 1);
  CHECK(names.problems[0].find("names.csv: feature 2") != std::string::npos);

  make_tiff(folder / "raster.tif", 30, 20, "EPSG:32631", kCoarse);
  check_error(list_rasters(folder / "raster.tif", geo::kWgs84), ErrorCode::unsupported, "raster.tif");
  write_file(folder / "noise.gpkg", std::string(5000, 'n'));
  check_error(list_rasters(folder / "noise.gpkg", geo::kWgs84), ErrorCode::unsupported, "noise.gpkg");
  check_error(list_rasters(folder / "none.gpkg", geo::kWgs84), ErrorCode::not_found, "none.gpkg");
}

// --- STAC ------------------------------------------------------------------------------------------------------------

namespace {

RasterList stac(const std::string& text, const geo::Ellipsoid& world = geo::kWgs84) {
  auto list = read_stac(text, "/data/lists", "items.json", world);
  REQUIRE_MESSAGE(list, list.error().message);
  return std::move(list).value();
}

const std::string kSquare = R"("geometry": {"type": "Polygon", "coordinates": [[[1, 2], [3, 2], [3, 4], [1, 4], [1, 2]]]})";
const std::string kAsset = R"("assets": {"a": {"href": "a.tif"}})";

std::string item(const std::string& members) { return R"({"type": "Feature", "id": "one", )" + members + "}"; }

std::string path_of_asset(const std::string& assets) {
  const RasterList list = stac(item(kSquare + R"(, "assets": {)" + assets + "}"));
  return list.rasters.empty() ? "none" : list.rasters[0].path;
}

double spacing_of(const std::string& properties, const std::string& asset) {
  return stac(item(kSquare + R"(, "properties": {)" + properties + R"(}, "assets": {"a": {"href": "a.tif")" + (asset.empty() ? "" : ", " + asset) + "}}")).rasters.at(0).spacing.value;
}

}  // namespace

TEST_CASE("read_stac: one item, and collections of items") {
  const RasterList one = stac(item(kSquare + R"(, "properties": {"gsd": 10.5}, )" + kAsset));
  REQUIRE(one.rasters.size() == 1);
  CHECK(one.rasters[0].path == "/data/lists/a.tif");
  CHECK(one.rasters[0].spacing.value == 10.5);
  check_ring(one.rasters[0].ring, {{1, 2}, {3, 2}, {3, 4}, {1, 4}}, "EPSG:4326");
  const std::string whole = item(kSquare + ", " + kAsset);
  for (const char* type : {"FeatureCollection", "ItemCollection"}) {
    const std::string text = fmt::format(R"({{"links": [{{"features": [1, {{}}]}}], "type": "{}", "features": [{}, {}, {{"id": "bare"}}, 5, null, [[]]], "context": {{"n": 2}}}})", type,
                                         item(R"("assets": {"a": {"href": "../b/./b.tif"}})"), whole);
    const RasterList list = stac(text);
    REQUIRE(list.rasters.size() == 2);
    CHECK(list.rasters[0].path == "/data/b/b.tif");
    CHECK(list.rasters[0].ring.empty());
    CHECK(list.rasters[1].ring.size() == 32);
    REQUIRE(list.problems.size() == 4);
    CHECK(list.problems[0].find("items.json: item \"bare\"") != std::string::npos);
    CHECK(list.problems[1].find("items.json: item 4") != std::string::npos);
  }
  CHECK(stac(R"({"type": "FeatureCollection", "features": []})").rasters.empty());
}

TEST_CASE("read_stac: the asset to show, and what it is called") {
  CHECK(path_of_asset(R"("x": {"href": "x.tif"}, "a": {"href": "a.tif"})") == "/data/lists/x.tif");  // the first written
  CHECK(path_of_asset(R"("x": {"href": "x.xml"}, "a": {"href": "a", "type": "image/tiff; application=geotiff"})") == "/data/lists/a");
  CHECK(path_of_asset(R"("x": {"href": "x.tif"}, "d": {"href": "d.tif", "roles": ["reflectance", "data"]})") == "/data/lists/d.tif");
  CHECK(path_of_asset(R"("d": {"href": "d.tif", "roles": ["data"]}, "v": {"href": "v.TIF", "roles": ["visual"]})") == "/data/lists/v.TIF");
  // A shaded relief beside the heights; a preview; a table.
  CHECK(path_of_asset(R"("h": {"href": "h.tif", "roles": ["overview", "visual"]}, "d": {"href": "d.tif", "roles": ["data"]})") == "/data/lists/d.tif");
  CHECK(path_of_asset(R"("thumbnail": {"href": "t.png"}, "p": {"href": "p.jpg", "type": "image/jpeg", "roles": ["thumbnail"]}, "a": {"href": "a.jp2"})") == "/data/lists/a.jp2");
  CHECK(path_of_asset(R"("d": {"href": "d.laz", "type": "application/vnd.laszip", "roles": ["data"]}, "a": {"href": "a.tif"})") == "/data/lists/a.tif");
  CHECK(path_of_asset(R"("a": {"href": "https://host/a.tif?sig=1%2F"})") == "https://host/a.tif?sig=1%2F");
  CHECK(path_of_asset(R"("a": {"href": "file:///x%20y/../a.tif"})") == "/a.tif");
  CHECK(path_of_asset(R"("a": {"href": "/x/a.tif"})") == "/x/a.tif");
  for (const char* none : {"", R"("a": 5)", R"("a": {"href": 5})", R"("a": {"href": ""})", R"("a": {"href": "a.xml"})", R"("a": {"type": "image/tiff"})",
                           R"("a": {"href": "s3://bucket/a.tif"})", R"("a": {"href": "file://host/a.tif"})", R"("a": {"href": "a\u0000.tif"})", R"("a": {"href": "a.tif", "roles": ["thumbnail"]})"}) {
    CAPTURE(none);
    const RasterList list = stac(item(kSquare + R"(, "assets": {)" + none + "}"));
    CHECK(list.rasters.empty());
    REQUIRE(list.problems.size() == 1);
    CHECK(list.problems[0].find("\"one\"") != std::string::npos);
  }
}

TEST_CASE("read_stac: rings from polygons, several of them, boxes, and across the antimeridian") {
  const auto ring = [](const std::string& members, const geo::Ellipsoid& world = geo::kWgs84) { return stac(item(members + ", " + kAsset), world).rasters.at(0).ring; };
  const std::string parts = R"("geometry": {"type": "MultiPolygon", "coordinates": [[[[178, -5], [180, -5], [180, 5], [178, 5], [178, -5]]], [[[-180, -5], [-177, -5], [-177, 5], [-180, 5], [-180, -5]]]]})";
  check_ring(ring(parts), {{178, -5}, {183, -5}, {183, 5}, {178, 5}}, "EPSG:4326");
  check_ring(ring(R"("bbox": [1, 2, 3, 4])"), {{1, 2}, {3, 2}, {3, 4}, {1, 4}}, "EPSG:4326");
  check_ring(ring(R"("bbox": [1, 2, -50, 3, 4, 900], "geometry": null)"), {{1, 2}, {3, 2}, {3, 4}, {1, 4}}, "EPSG:4326");
  check_ring(ring(R"("bbox": [179, 2, -178, 4])"), {{179, 2}, {182, 2}, {182, 4}, {179, 4}}, "EPSG:4326");
  const std::string jumping = R"("geometry": {"type": "Polygon", "coordinates": [[[179, 2], [-178, 2], [-178, 4], [179, 4], [179, 2]]]})";
  CHECK(ring(jumping).empty());
  check_ring(ring(jumping + R"(, "bbox": [179, 2, -178, 4])"), {{179, 2}, {182, 2}, {182, 4}, {179, 4}}, "EPSG:4326");
  check_ring(ring(R"("geometry": {"type": "Polygon", "coordinates": [[[1, 2, 100], [3, 2, 100], [2, 4, 100], [1, 2, 100]]]})"), {{1, 2}, {3, 2}, {2, 4}}, "EPSG:4326");
  // Mars is flattened, and lists of it do not say which latitudes they mean; on the Moon there is but one kind.
  CHECK(ring(kSquare, geo::kMars).empty());
  CHECK(ring(kSquare, geo::kMoon).size() == 32);
  for (const char* wrong : {R"({"type": "Polygon", "coordinates": [[[1, 2], [3, "2"], [3, 4], [1, 2]]]})", R"({"type": "Polygon", "coordinates": [[[1, 2], [3], [3, 4], [1, 2]]]})",
                            R"({"type": "Polygon", "coordinates": [[[1, 2], [3, 91], [3, 4], [1, 2]]]})", R"({"type": "Polygon", "coordinates": [[[1, 2], [3e300, 2], [3, 4], [1, 2]]]})",
                            R"({"type": "Polygon", "coordinates": [[[1, 2], [3, 2], [1, 2]]]})", R"({"type": "Polygon", "coordinates": []})", R"({"type": "Polygon"})",
                            R"({"type": "Polygon", "coordinates": {"a": [[1, 2]]}})", R"({"type": "MultiPolygon", "coordinates": [1]})", R"({"type": "MultiPolygon", "coordinates": []})",
                            R"({"type": "Point", "coordinates": [1, 2]})", "5", "[]", R"("Polygon")"}) {
    CAPTURE(wrong);
    CHECK(ring(std::string(R"("geometry": )") + wrong).empty());
    CHECK(ring(std::string(R"("bbox": [5, 6, 7, 8], "geometry": )") + wrong).size() == 32);
  }
  for (const char* wrong : {"[1, 2, 3]", "[1, 4, 3, 2]", R"([1, 2, "3", 4])", "[1, 2, 3, 91]", "[1, 2, 3, null]", "{}", "7"}) {
    CAPTURE(wrong);
    CHECK(ring(std::string(R"("bbox": )") + wrong).empty());
  }
}

TEST_CASE("read_stac: the spacing is the finest of the bands, else the transform's, else the ground sample distance") {
  CHECK(spacing_of("", "") == 0.0);
  CHECK(spacing_of(R"("gsd": 30)", "") == 30.0);
  CHECK(spacing_of(R"("gsd": 30)", R"("gsd": 60)") == 60.0);
  CHECK(spacing_of(R"("gsd": 30)", R"("gsd": 60, "raster:bands": [{"spatial_resolution": 20}, {"spatial_resolution": 10}, {}])") == 10.0);
  CHECK(spacing_of("", R"("bands": [{"raster:spatial_resolution": 12}])") == 12.0);
  CHECK(spacing_of(R"("proj:epsg": 32631, "gsd": 1)", R"("proj:transform": [10, 0, 500000, 0, -20, 4600000])") == 20.0);
  CHECK(spacing_of(R"("proj:code": "EPSG:32731", "proj:transform": [3, 0, 500000, 4, -2, 4600000, 0, 0, 1])", "") == 5.0);
  // The square lies round 3 degrees north: a ten-thousandth of a degree along the equator's circle is 11.132 m.
  CHECK(spacing_of(R"("proj:epsg": 4326)", R"("proj:transform": [0.0001, 0, 1, 0, -0.00005, 4])") == doctest::Approx(11.132 * std::cos(3 / kToDegrees)).epsilon(1e-4));
  CHECK(spacing_of(R"("proj:epsg": 3857)", R"("proj:transform": [10, 0, 1, 0, -10, 4])") == doctest::Approx(10 * std::cos(3 / kToDegrees)).epsilon(1e-9));
  CHECK(spacing_of(R"("proj:epsg": 2056)", R"("proj:transform": [10, 0, 1, 0, -10, 4])") == 0.0);
  for (const char* wrong : {R"("gsd": "10")", R"("gsd": 0)", R"("gsd": -3)", R"("gsd": 1e300)", R"("gsd": null)", R"("proj:epsg": 32631, "proj:transform": [1, 2])",
                            R"("proj:epsg": 32631, "proj:transform": [0, 0, 1, 0, 0, 4])", R"("proj:epsg": 32631, "proj:transform": "10")", R"("proj:epsg": "x", "proj:transform": [1, 0, 1, 0, 1, 4])"}) {
    CAPTURE(wrong);
    CHECK(spacing_of(wrong, "") == 0.0);
    CHECK(spacing_of("", wrong) == 0.0);
  }
}

TEST_CASE("read_stac: wrong files are refused with their names") {
  const auto check_refused = [](const std::string& text, ErrorCode code, const std::string& part) {
    CAPTURE(text.substr(0, 100));
    check_error(read_stac(text, "/f", "items.json", geo::kWgs84), code, part);
    check_error(read_stac(text, "/f", "items.json", geo::kWgs84), code, "items.json");
  };
  check_refused("", ErrorCode::corrupt, "JSON");
  check_refused("{", ErrorCode::corrupt, "JSON");
  check_refused(item(kAsset) + "}", ErrorCode::corrupt, "JSON");
  check_refused(R"({"type": "Feature", "bbox": [NaN, 1, 2, 3], "assets": {}})", ErrorCode::corrupt, "JSON");
  check_refused(R"({"type": "Feature", "bbox": [1e999, 1, 2, 3], "assets": {}})", ErrorCode::corrupt, "JSON");
  check_refused("{\"id\": \"\xff\"}", ErrorCode::corrupt, "JSON");
  check_refused(std::string(100'000, '['), ErrorCode::corrupt, "deep");
  check_refused(R"({"features": [)" + std::string(100'000, '['), ErrorCode::corrupt, "deep");
  check_refused("[]", ErrorCode::unsupported, "no STAC item");
  check_refused("\"text\"", ErrorCode::unsupported, "no STAC item");
  check_refused("{}", ErrorCode::unsupported, "no STAC item");
  check_refused(R"({"type": "Collection", "links": []})", ErrorCode::unsupported, "/items");
  check_refused(R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"location": "a.tif"}}]})", ErrorCode::unsupported, "assets");
  std::string large = R"({"features": [{"assets": {}, "many": [1)";
  for (int i = 0; i < 2'000'000; ++i) large += ",1";
  check_refused(large + "]}]}", ErrorCode::exhausted, "values");
}

TEST_CASE("read_stac: as many items as a list may hold, and one more") {
  std::string text = R"({"features": [)";
  for (std::size_t i = 0; i < kMostListed; ++i) text += R"({"assets":{"a":{"href":"a.tif"}}},)";
  const std::string full = text.substr(0, text.size() - 1) + "]}";
  CHECK(stac(full).rasters.size() == kMostListed);
  check_error(read_stac(text + item(kAsset) + "]}", "/f", "items.json", geo::kWgs84), ErrorCode::exhausted, "split");
}

// --- Folders and what a path is --------------------------------------------------------------------------------------

TEST_CASE("list_rasters: a folder's rasters with those below it, by their endings and in the order of their paths") {
  const Folder folder("list_folder");
  fs::create_directories(folder / "b/c");
  fs::create_directories(folder / ".hidden");
  for (const char* name : {"z.tif", "a.TIF", "b/m.jp2", "b/c/n.dt2", "b/o.vrt", "pds.img", "pds.lbl", "plain.img", "b/a.hgt"}) write_file(folder / name, "");
  for (const char* name : {"a.tif.aux.xml", "a.TIF.ovr", "a.tif.msk", "a.tfw", "a.wld", "a.txt", "a.xml", "a.json", "a.html", "a.pdf", "a.csv", "a.shp", "a.gpkg", "a.geojson", "a.hdr",
                           "tif", ".tif", "._z.tif", ".hidden/h.tif", "b/README", "b/x.", "b/x.cpp"})
    write_file(folder / name, "");
  fs::create_directories(folder / "folder.tif");
  write_file(folder / "folder.tif/in.tif", "");
  const RasterList list = listed(folder / "");
  CHECK(list.problems.empty());
  CHECK(names_of(list) == Names{"a.TIF", "a.hgt", "n.dt2", "m.jp2", "o.vrt", "in.tif", "pds.lbl", "plain.img", "z.tif"});
  CHECK(list.rasters[2].path == (folder / "b/c/n.dt2").string());
  CHECK(list.rasters[0].ring.empty());
  CHECK(list.rasters[0].spacing.value == 0.0);
  const auto before = fs::current_path();
  fs::current_path(folder / "b");
  CHECK(listed("../b/c").rasters[0].path == (fs::current_path() / "c/n.dt2").string());
  fs::current_path(before);
}

TEST_CASE("list_rasters: links to folders are followed once, and folders too deep are told") {
  const Folder folder("list_links");
  fs::create_directories(folder / "in/a");
  fs::create_directories(folder / "out");
  write_file(folder / "in/a/a.tif", "");
  write_file(folder / "out/o.tif", "");
  fs::create_directory_symlink(folder / "in", folder / "in/a/round");
  fs::create_directory_symlink("..", folder / "in/up");
  fs::create_directory_symlink(folder / "out", folder / "in/one");
  fs::create_directory_symlink(folder / "out", folder / "in/two");
  fs::create_symlink(folder / "in/nothing.tif", folder / "in/broken.tif");
  fs::create_symlink(folder / "out/o.tif", folder / "in/linked.tif");
  CHECK(names_of(listed(folder / "in")) == Names{"a.tif", "linked.tif", "o.tif"});

  fs::path deep = folder / "deep";
  for (int i = 0; i < 70; ++i) deep /= "d";
  fs::create_directories(deep);
  write_file(deep / "d.tif", "");
  write_file(folder / "deep/d/e.tif", "");
  const RasterList list = listed(folder / "deep");
  CHECK(names_of(list) == Names{"e.tif"});
  CHECK(list.problems.size() == 1);
  fs::create_directories(folder / "empty");
  CHECK(listed(folder / "empty").rasters.empty());
}

TEST_CASE("list_rasters: what is not there, no file, or too large") {
  const Folder folder("list_wrong");
  check_error(list_rasters(folder / "none", geo::kWgs84), ErrorCode::not_found, "none");
  check_error(list_rasters("", geo::kWgs84), ErrorCode::not_found, "");
  check_error(list_rasters("/dev/null", geo::kWgs84), ErrorCode::unsupported, "/dev/null");
  for (const char* name : {"large.vrt", "large.json"}) {
    write_file(folder / name, "{");
    fs::resize_file(folder / name, std::uintmax_t{300} << 20);  // takes no room on the disk
    check_error(list_rasters(folder / name, geo::kWgs84), ErrorCode::exhausted, "256 MB");
  }
  write_file(folder / "world.json", R"({"layers": []})");
  check_error(list_rasters(folder / "world.json", geo::kWgs84), ErrorCode::unsupported, "world.json: is no STAC item");
}

TEST_CASE("listed_path: files become whole, URLs and the names of GDAL's own files stay") {
  CHECK(listed_path("a/../b.tif", "/f") == "/f/b.tif");
  CHECK(listed_path("/a/./b.tif", "/f") == "/a/b.tif");
  CHECK(listed_path("https://host/a/../b.tif", "/f") == "https://host/a/../b.tif");
  CHECK(listed_path("/vsicurl/https://host/b.tif", "/f") == "https://host/b.tif");
  CHECK(listed_path("/vsizip/a.zip/../b.tif", "/f") == "/vsizip/a.zip/../b.tif");
  CHECK(listed_path("NETCDF:\"/a.nc\":z", "/f") == "NETCDF:\"/a.nc\":z");
  CHECK(listed_path("c:b.tif", "/f") == "/f/c:b.tif");
}

TEST_CASE("join_longitudes: no place lies more than half a turn from the one before") {
  const auto joined = [](std::vector<double> degrees) {
    std::vector<geo::LatLon> ring;
    ring.reserve(degrees.size());
    for (const double d : degrees) ring.push_back({Radians(0.0), Radians(d / kToDegrees)});
    join_longitudes(ring);
    for (std::size_t i = 0; i < degrees.size(); ++i) degrees[i] = std::round(ring[i].longitude.value * kToDegrees * 1e6) / 1e6;
    return degrees;
  };
  CHECK(joined({179, -179, -178, 178}) == std::vector<double>{179, 181, 182, 178});
  CHECK(joined({-170, 170, -170}) == std::vector<double>{-170, -190, -170});
  CHECK(joined({0, 90, 180, -90, 0}) == std::vector<double>{0, 90, 180, 270, 360});
  CHECK(joined({}).empty());
}
