// Where services' tiles lie. Expected values by hand from the standards' formulas; axes as PROJ's projinfo prints them.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "source/proj/crs_axes.h"
#include "source/service_documents.h"
#include "source/tiles/crs_name.h"
#include "source/tiles/service_grids.h"
#include "source/tiles/service_url.h"

using namespace tellurion;
using namespace tellurion::source;
using namespace test_services;

namespace {

constexpr double kHalf = 20037508.342789244;

CrsAxes axes(const char* crs) { return axes_of(crs).value(); }

TileMatrixSet one_matrix(const char* crs, double scale, glm::dvec2 corner, std::int64_t columns, std::int64_t rows) {
  return {"set", crs, {{"0", scale, corner, 256, 256, columns, rows}}};
}

}  // namespace

TEST_CASE("crs_name: what services write, as PROJ has it") {
  CHECK(crs_name("urn:ogc:def:crs:EPSG::4326") == "EPSG:4326");
  CHECK(crs_name("urn:ogc:def:crs:EPSG:6.18.3:3857") == "EPSG:3857");
  CHECK(crs_name("urn:ogc:def:crs:EPSG:6.18:3:3857") == "EPSG:3857");
  CHECK(crs_name("urn:ogc:def:crs:OGC:1.3:CRS84") == "OGC:CRS84");
  CHECK(crs_name("urn:ogc:def:crs:OGC:2:84") == "OGC:CRS84");
  CHECK(crs_name("CRS:84") == "OGC:CRS84");
  CHECK(crs_name("http://www.opengis.net/def/crs/EPSG/0/31467") == "EPSG:31467");
  CHECK(crs_name("http://www.opengis.net/gml/srs/epsg.xml#4326") == "EPSG:4326");
  CHECK(crs_name("EPSG:900913") == "EPSG:3857");
  CHECK(crs_name("epsg:3035") == "EPSG:3035");
  CHECK(crs_name("IAU2000:49900") == "IAU_2015:49900");
  CHECK(crs_name("+proj=longlat +a=1 +b=1") == "+proj=longlat +a=1 +b=1");
  CHECK(crs_name("") == "");
}

TEST_CASE("axes_of: which axis comes first") {
  CHECK(axes("EPSG:4326").north_first);
  CHECK(!axes("OGC:CRS84").north_first);
  CHECK(!axes("EPSG:3857").north_first);
  CHECK(axes("EPSG:3035").north_first);
  CHECK(axes("EPSG:31467").north_first);
  CHECK(!axes("EPSG:3995").north_first);
  CHECK(!axes("EPSG:3031").north_first);
  CHECK(axes("EPSG:32661").north_first);   // UPS North (N,E)
  CHECK(!axes("EPSG:5041").north_first);   // UPS North (E,N)
  CHECK(axes("EPSG:4258").is_geographic);
  CHECK(axes("EPSG:2263").metres_per_unit == doctest::Approx(0.3048006096));  // US survey feet
  CHECK(axes_of("EPSG:12").error().code == ErrorCode::invalid_argument);
  CHECK(axes_of("EPSG:5773").error().code == ErrorCode::unsupported);
}

TEST_CASE("matrix_grid: scales to pixels, corners to (x, y)") {
  // OGC 07-057r7, annex E.4: GoogleMapsCompatible.
  const auto mercator = matrix_grid(one_matrix("urn:ogc:def:crs:EPSG::3857", 559082264.0287178, {-20037508.3427892, 20037508.3427892}, 1, 1), {}, axes("EPSG:3857"), "EPSG:3857", {});
  REQUIRE(mercator);
  CHECK(mercator->grid.levels[0].pixel.x == doctest::Approx(156543.03392804097).epsilon(1e-14));
  CHECK(mercator->grid.levels[0].corner.x == doctest::Approx(-kHalf).epsilon(1e-15));
  // Annex E.3: GoogleCRS84Quad.
  const auto quad = matrix_grid(one_matrix("urn:ogc:def:crs:OGC:1.3:CRS84", 559082264.0287178, {-180, 90}, 1, 1), {}, axes("OGC:CRS84"), "OGC:CRS84", {});
  REQUIRE(quad);
  CHECK(quad->grid.levels[0].pixel.x == 1.40625);
  // A scale with few digits still goes round the Earth.
  const auto rounded = matrix_grid(one_matrix("EPSG:4326", 559082264, {90, -180}, 1, 1), {}, axes("EPSG:4326"), "EPSG:4326", {});
  CHECK(rounded->grid.levels[0].pixel.x == 1.40625);
  CHECK(rounded->grid.levels[0].corner == glm::dvec2(-180, 90));
  // Feet: 1:12000 is a pixel of 3.36 m.
  const auto feet = matrix_grid(one_matrix("EPSG:2263", 12000, {900000, 300000}, 4, 4), {}, axes("EPSG:2263"), "EPSG:2263", {});
  CHECK(feet->grid.levels[0].pixel.x == doctest::Approx(3.36 / 0.3048006096));
}

TEST_CASE("matrix_grid: the order of axes") {
  const auto corner = [](const char* crs, glm::dvec2 written, std::optional<glm::dvec2> inside = {}) {
    return matrix_grid(one_matrix(crs, 1e6, written, 8, 8), {}, axes_of(crs_name(crs)).value(), crs_name(crs), inside)->grid.levels[0].corner;
  };
  CHECK(corner("urn:ogc:def:crs:EPSG::4326", {90, -180}) == glm::dvec2(-180, 90));
  CHECK(corner("EPSG:4326", {90, -180}) == glm::dvec2(-180, 90));
  CHECK(corner("EPSG:4326", {-180, 90}) == glm::dvec2(-180, 90));  // written the wrong way round
  CHECK(corner("urn:ogc:def:crs:OGC:1.3:CRS84", {-180, 90}) == glm::dvec2(-180, 90));
  CHECK(corner("urn:ogc:def:crs:OGC:1.3:CRS84", {90, -180}) == glm::dvec2(-180, 90));
  CHECK(corner("urn:ogc:def:crs:EPSG::31467", {5500000, 3400000}) == glm::dvec2(3400000, 5500000));
  // 2048 pixels of 280 m are 573 km: a place that only the other order covers.
  CHECK(corner("EPSG:31467", {3400000, 5500000}, glm::dvec2(3500000, 5400000)) == glm::dvec2(3400000, 5500000));
  CHECK(corner("EPSG:31467", {5500000, 3400000}, glm::dvec2(3500000, 5400000)) == glm::dvec2(3400000, 5500000));
  CHECK(corner("EPSG:3857", {1000, 2000}, glm::dvec2(2100, 900)) == glm::dvec2(1000, 2000));
}

TEST_CASE("matrix_grid: limits leave matrices and tiles out") {
  const auto service = parse_wmts_capabilities(kWmts).value();
  const auto grid = matrix_grid(service.matrix_sets[0], service.layers[0].links[0].limits, axes("EPSG:4326"), "EPSG:4326", {});
  REQUIRE(grid);
  REQUIRE(grid->matrices == std::vector<std::string>{"one"});
  CHECK(grid->grid.levels[0].pixel.x == 0.3515625);
  CHECK(grid->ranges[0].contains({0, 1, 0}));
  CHECK(!grid->ranges[0].contains({0, 0, 0}));
  CHECK(!grid->ranges[0].contains({0, 3, 1}));
  const auto all = matrix_grid(service.matrix_sets[0], {}, axes("EPSG:4326"), "EPSG:4326", {});
  CHECK(all->matrices == std::vector<std::string>{"zero", "one"});
  CHECK(!matrix_grid({"none", "EPSG:4326", {}}, {}, axes("EPSG:4326"), "EPSG:4326", {}));
  // Finest first, one of another tile size, one as fine as another.
  TileMatrixSet mixed{"mixed", "EPSG:3857", {{"a", 1000, {0, 1000}, 256, 256, 4, 4}, {"b", 2000, {0, 1000}, 256, 256, 2, 2}, {"c", 4000, {0, 1000}, 512, 512, 1, 1}, {"d", 1000, {0, 1000}, 256, 256, 4, 4}}};
  CHECK(matrix_grid(mixed, {}, axes("EPSG:3857"), "EPSG:3857", {})->matrices == std::vector<std::string>{"b", "a"});
}

TEST_CASE("box_grid: one tile over the box, halved down to the finest pixel") {
  const auto grid = box_grid("EPSG:25832", {400000, 5000000, 800000, 5200000}, 256, 100);
  REQUIRE(grid);
  CHECK(grid->levels[0].pixel.x == 400000.0 / 256);
  CHECK(grid->levels[0].columns == 1);
  CHECK(grid->levels[0].rows == 1);
  CHECK(grid->levels[2].columns == 4);
  CHECK(grid->levels[2].rows == 2);
  CHECK(grid->levels.back().pixel.x <= 100);
  CHECK(grid->levels[grid->levels.size() - 2].pixel.x > 100);
  CHECK(grid->levels[0].corner == glm::dvec2(400000, 5200000));
  CHECK(!box_grid("EPSG:25832", {0, 0, 0, 1}, 256, 1));
  CHECK(box_grid("EPSG:25832", {0, 0, 1e7, 1e7}, 4096, 0)->levels.size() <= 31);
}

TEST_CASE("tms_grid: whole Mercator, also where its extent is in degrees") {
  const char* const kRest = R"(<TileFormat width="256" height="256" extension="png"/><TileSets profile="mercator">
    <TileSet href="0" units-per-pixel="156543.0339" order="0"/><TileSet href="2" units-per-pixel="39135.758475" order="2"/></TileSets></TileMap>)";
  const char* const kDegrees = R"(<TileMap><SRS>EPSG:3857</SRS><BoundingBox minx="-180.0" miny="-85.05112878" maxx="179.99792885876383" maxy="85.05112878"/><Origin x="-180.0" y="-85.05112878"/>)";
  const char* const kSwapped = R"(<TileMap><SRS>EPSG:900913</SRS><BoundingBox minx="-85.05112878" miny="-180.0" maxx="85.05112878" maxy="180.0"/><Origin x="-180.0" y="-85.05112878"/>)";
  const char* const kMetres = R"(<TileMap><SRS>OSGEO:41001</SRS><BoundingBox minx="-20037508.34" miny="-20037508.34" maxx="20037508.34" maxy="20037508.34"/><Origin x="-20037508.34" y="-20037508.34"/>)";
  for (const char* head : {kDegrees, kSwapped, kMetres}) {
    const auto map = parse_tms_resource(std::string(head) + kRest);
    REQUIRE(map);
    const auto grid = tms_grid(*map, axes("EPSG:3857"), crs_name(map->crs));
    REQUIRE(grid);
    REQUIRE(grid->grid.levels.size() == 2);
    CHECK(grid->grid.levels[0].corner.x == doctest::Approx(-kHalf).epsilon(1e-12));
    CHECK(grid->grid.levels[0].corner.y == doctest::Approx(kHalf).epsilon(1e-7));
    CHECK(grid->grid.levels[0].columns == 1);
    CHECK(grid->grid.levels[1].columns == 4);
    CHECK(grid->grid.levels[1].rows == 4);
    CHECK(grid->south_rows[1] == 3);
    CHECK(grid->hrefs[1] == "2");
    CHECK(grid->bounds.has_value() == (head != kMetres));
  }
}

TEST_CASE("tms_grid: a region in UTM, rows from the south") {
  const auto map = parse_tms_resource(R"(<TileMap><SRS>EPSG:32633</SRS><BoundingBox minx="500000" miny="5000000" maxx="503000" maxy="5001000"/><Origin x="500000" y="5000000"/>
    <TileFormat width="256" height="256" extension="png"/><TileSets profile="raster"><TileSet href="0" units-per-pixel="10" order="0"/><TileSet href="1" units-per-pixel="5" order="1"/></TileSets></TileMap>)");
  const auto grid = tms_grid(*map, axes("EPSG:32633"), "EPSG:32633");
  REQUIRE(grid);
  // 3000 m are 1.17 tiles of 2560 m, 1000 m 0.39.
  CHECK(grid->grid.levels[0].columns == 2);
  CHECK(grid->grid.levels[0].rows == 1);
  CHECK(grid->grid.levels[0].corner == glm::dvec2(500000, 5002560));
  CHECK(grid->grid.levels[1].columns == 3);
  CHECK(grid->grid.levels[1].corner == glm::dvec2(500000, 5001280));
  CHECK(!grid->bounds);
}

TEST_CASE("matrix_grid and tms_grid: numbers beyond all maps make no level") {
  CHECK(!matrix_grid(one_matrix("EPSG:3857", 1e6, {1e300, 0}, 1, 1), {}, axes("EPSG:3857"), "EPSG:3857", {}));
  CHECK(!matrix_grid(one_matrix("EPSG:3857", 1e-200, {0, 0}, 1, 1), {}, axes("EPSG:3857"), "EPSG:3857", {}));
  CHECK(!matrix_grid(one_matrix("EPSG:3857", 1e6, {0, 0}, 0, 1), {}, axes("EPSG:3857"), "EPSG:3857", {}));
  // A small map with tiles of 1e-20 degrees, of which more than can be counted go round the Earth.
  const auto map = parse_tms_resource(R"(<TileMap><SRS>EPSG:4326</SRS><BoundingBox minx="-180" miny="-90" maxx="-179.99999999999997" maxy="-89.99999999999998"/><Origin x="-180" y="-90"/>
    <TileFormat width="256" height="256" extension="png"/><TileSets profile="raster"><TileSet href="0" units-per-pixel="1e-20" order="0"/></TileSets></TileMap>)");
  REQUIRE(map);
  CHECK(!tms_grid(*map, axes("EPSG:4326"), "EPSG:4326"));
  // Levels beyond the last are not looked at.
  TileMatrixSet deep{"deep", "EPSG:3857", {}};
  for (int i = 0; i < 40; ++i) deep.matrices.push_back({std::to_string(i), std::ldexp(1e6, -i), {0, 1000}, 256, 256, 1, 1});
  CHECK(matrix_grid(deep, {}, axes("EPSG:3857"), "EPSG:3857", {})->grid.levels.size() == 31);
}

TEST_CASE("grid_crs: degrees of the Earth count as those of another body") {
  CHECK(grid_crs("EPSG:4326", axes("EPSG:4326"), geo::kWgs84) == "EPSG:4326");
  CHECK(grid_crs("EPSG:4326", axes("EPSG:4326"), geo::kMars).starts_with("+proj=longlat"));
  CHECK(grid_crs("IAU_2015:49900", axes("IAU_2015:49900"), geo::kMars) == "IAU_2015:49900");
}

TEST_CASE("service URLs: parameters") {
  CHECK(escaped("a b/ü&=") == "a%20b/%C3%BC%26%3D");
  CHECK(escaped("a/b", true) == "a%2Fb");
  CHECK(has_parameter("http://h/a?Request=x", "request"));
  CHECK(!has_parameter("http://h/request?b=request", "request"));
  CHECK(with_parameters("http://h/a", {{"A", "1"}}) == "http://h/a?A=1");
  CHECK(with_parameters("http://h/a?", {{"A", "1"}, {"B", "x y"}}) == "http://h/a?A=1&B=x%20y");
  CHECK(with_parameters("http://h/a?map=m&a=0&#x", {{"A", "1"}}) == "http://h/a?map=m&A=1");
  CHECK(with_given_parameters("http://h/t/1.png", "http://h/caps?SERVICE=WMTS&key=k&layer=x") == "http://h/t/1.png?key=k");
  CHECK(with_given_parameters("http://h/t?key=own", "http://h/caps?key=k") == "http://h/t?key=own");
  CHECK(with_given_parameters("http://other/t", "http://h/caps?key=k") == "http://other/t");
  CHECK(with_given_parameters("http://h:81/t", "http://h/caps?key=k") == "http://h:81/t");
  CHECK(with_given_parameters("http://h/t", "https://h/caps?key=k") == "http://h/t");
  CHECK(without_secrets("wrong key sesame!", "http://h/?a=1&key=sesame", "http://h/?a=1") == "wrong key ...!");
}

TEST_CASE("service URLs: references") {
  CHECK(resolved_url("http://h/a/b.xml?c=d", "0") == "http://h/a/0");
  CHECK(resolved_url("http://h/a/b.xml", "./0") == "http://h/a/0");
  CHECK(resolved_url("http://h/a/b.xml", "/0") == "http://h/0");
  CHECK(resolved_url("http://h", "0") == "http://h/0");
  CHECK(resolved_url("http://h/a/b.xml", "https://i/0") == "https://i/0");
  CHECK(resolved_url("https://h/a/b.xml", "//i/0") == "https://i/0");
  CHECK(resolved_url("http://h/a/b.xml", "ftp://i/0") == "ftp://i/0");
  CHECK(resolved_url("http://h/a/b.xml", "0?to=http://i") == "http://h/a/0?to=http://i");
}

TEST_CASE("service URLs: which are of the same server") {
  CHECK(same_server("http://h/a", "HTTP://user:word@H:80/b?c"));
  CHECK(same_server("https://h", "https://h:443/"));
  CHECK(same_server("http://[::1]:8080/a", "http://[::1]:8080/b"));
  CHECK_FALSE(same_server("http://h/", "https://h/"));
  CHECK_FALSE(same_server("http://h/", "http://h:8080/"));
  CHECK_FALSE(same_server("http://h@other/", "http://h/"));
  CHECK_FALSE(same_server("http://h.other/", "http://h/"));
  CHECK_FALSE(same_server("a", "a"));
  CHECK_FALSE(same_server("", ""));
}
