// What services say of themselves. Expected values: the documents' own, read by eye.
#include <doctest/doctest.h>

#include "source/service_documents.h"
#include "source/tiles/bounded_xml.h"
#include "source/tiles/tms_resource.h"
#include "source/tiles/wms_capabilities.h"
#include "source/tiles/wmts_capabilities.h"

using namespace tellurion;
using namespace tellurion::source;
using namespace test_services;

namespace {

template <class Parsed>
std::string fault_of(Result<Parsed> (*parse)(std::string_view), const std::string& text) {
  const Result<Parsed> parsed = parse(text);
  return parsed ? "" : parsed.error().message;
}

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("parse_wmts_capabilities: all that a layer and a matrix set say") {
  const auto service = parse_wmts_capabilities(kWmts);
  REQUIRE(service);
  CHECK(service->title == "Rain & snow");
  CHECK(service->provider == "The Weather Office");
  CHECK(service->get_tile == "http://h/kvp?");
  const WmtsLayer* layer = service->find_layer("rain");
  REQUIRE(layer);
  CHECK(!service->find_layer("Rain"));
  CHECK(layer->bounds == std::array{-10.0, 35.0, 30.0, 60.0});
  REQUIRE(layer->styles.size() == 2);
  CHECK(layer->styles[1].identifier == "blue");
  CHECK(layer->styles[1].is_default);
  CHECK(!layer->styles[0].is_default);
  CHECK(layer->formats == std::vector<std::string>{"image/png", "image/jpeg"});
  REQUIRE(layer->dimensions.size() == 2);
  CHECK(layer->dimensions[0].standard == "2020-01-02");
  CHECK(layer->dimensions[1].standard == "500");  // no default: the last value
  REQUIRE(layer->resources.size() == 1);
  CHECK(layer->resources[0].pattern == "http://h/{Style}/{Time}/{TileMatrix}/{TileRow}/{TileCol}.png");
  REQUIRE(layer->links.size() == 1);
  REQUIRE(layer->links[0].limits.size() == 1);
  CHECK(layer->links[0].limits[0].most_column == 2);
  const TileMatrixSet* set = service->find_matrix_set("degrees");
  REQUIRE(set);
  CHECK(set->crs == "urn:ogc:def:crs:EPSG::4326");
  REQUIRE(set->matrices.size() == 2);  // the third makes no sense
  CHECK(set->matrices[1].scale_denominator == 1.3977056600717944E8);
  CHECK(set->matrices[1].corner == glm::dvec2(90.0, -180.0));
  CHECK(set->matrices[1].columns == 4);
}

TEST_CASE("parse_wmts_capabilities: MapProxy's, with and without templates") {
  const auto kvp = parse_wmts_capabilities(saved("mapproxy_wmts_kvp.xml"));
  REQUIRE(kvp);
  CHECK(kvp->get_tile == "http://127.0.0.1:8998/service?");
  CHECK(kvp->layers.at(0).resources.empty());
  const auto rest = parse_wmts_capabilities(saved("mapproxy_wmts_rest.xml"));
  REQUIRE(rest);
  CHECK(rest->get_tile.empty());
  REQUIRE(rest->layers.at(0).resources.size() == 1);
  CHECK(rest->layers.at(0).links.size() == 3);
  CHECK(rest->matrix_sets.at(2).matrices.at(4).corner == glm::dvec2(-4500000.0, 4500000.0));
}

TEST_CASE("parse_wms_capabilities: nested layers inherit, versions differ") {
  const auto service = parse_wms_capabilities(kWms13);
  REQUIRE(service);
  CHECK(service->is_1_3);
  CHECK(service->get_map == "http://h/wms?map=a&");
  CHECK(service->most_width == 200);
  CHECK(!service->find_layer(""));
  const WmsLayer* found = service->find_layer("roads");
  REQUIRE(found);
  const WmsLayer roads = service->resolved(*found);
  CHECK(roads.crs == std::vector<std::string>{"EPSG:3857", "EPSG:25832", "EPSG:4326", "CRS:84"});
  CHECK(roads.styles == std::vector<std::string>{"relief", "plain"});
  CHECK(roads.attribution == "Road people");
  CHECK(roads.opaque == true);
  CHECK(roads.least_scale == 5000);
  CHECK(roads.most_scale == 1000000);
  CHECK(roads.bounds == std::array{-180.0, -20.0, 180.0, 10.0});  // across the antimeridian: all round
  REQUIRE(roads.boxes.size() == 2);
  CHECK(roads.boxes[0].crs == "EPSG:25832");
  CHECK(service->resolved(*service->find_layer("ground")).attribution == "The mapmakers");

  const auto old = parse_wms_capabilities(kWms11);
  REQUIRE(old);
  CHECK(!old->is_1_3);
  const WmsLayer* a = old->find_layer("a");
  REQUIRE(a);
  CHECK(a->crs == std::vector<std::string>{"EPSG:4326", "EPSG:31467", "EPSG:3857"});
  CHECK(a->bounds == std::array{5.0, 45.0, 15.0, 55.0});
  CHECK(!a->least_scale);
  CHECK(a->most_scale.value_or(0) == doctest::Approx(100000).epsilon(1e-9));  // a square pixel of 28 m has this diagonal
}

TEST_CASE("parse_wms_capabilities: MapProxy's of both versions") {
  for (const char* version : {"1.1.1", "1.3.0"}) {
    const auto service = parse_wms_capabilities(saved(std::string("mapproxy_wms_") + version + ".xml"));
    REQUIRE(service);
    CHECK(service->is_1_3 == (std::string(version) == "1.3.0"));
    CHECK(service->title == "Night over the Earth");
    const WmsLayer* night = service->find_layer("night");
    REQUIRE(night);
    CHECK(night->crs.size() >= 7);
    REQUIRE(night->bounds);
    CHECK((*night->bounds)[3] == doctest::Approx(85.0511287798066));
  }
}

TEST_CASE("parse_tms_resource: gdal2tiles' and MapProxy's") {
  const auto map = parse_tms_resource(saved("mapproxy_tms.xml"));
  REQUIRE(map);
  CHECK(map->crs == "OSGEO:41001");
  CHECK(map->profile == "global-mercator");
  CHECK(map->extension == "png");
  REQUIRE(map->levels.size() == 4);
  CHECK(map->levels[0].units_per_pixel == 78271.51696402048);
  const auto own = parse_tms_resource(R"(<TileMap><SRS>EPSG:32633</SRS><BoundingBox minx="1" miny="2" maxx="3" maxy="4"/><Origin x="1" y="2"/>
    <TileFormat width="512" height="512" extension=".jpg"/><TileSets profile="raster"><TileSet href="1" units-per-pixel="1" order="1"/>
    <TileSet href="0" units-per-pixel="2" order="0"/><TileSet href="-1" units-per-pixel="4" order="-1"/></TileSets></TileMap>)");
  REQUIRE(own);
  CHECK(own->extension == "jpg");
  CHECK(own->tile_width == 512);
  REQUIRE(own->levels.size() == 2);  // sorted, and not the one before the first
  CHECK(own->levels[0].href == "0");
}

TEST_CASE("services: what is no such document is told in words") {
  CHECK(has(fault_of(parse_wmts_capabilities, ""), "empty"));
  CHECK(has(fault_of(parse_wmts_capabilities, "<!DOCTYPE html><html><body>Log in</body></html>"), "HTML"));
  CHECK(has(fault_of(parse_wmts_capabilities, "<Capabilities><Contents>"), "line 1"));
  CHECK(has(fault_of(parse_wmts_capabilities, "{\"error\": 1}"), "XML"));
  CHECK(has(fault_of(parse_wmts_capabilities, kWms13), "\"wms\""));
  CHECK(has(fault_of(parse_wms_capabilities, kWmts), "\"wmts\""));
  CHECK(has(fault_of(parse_wms_capabilities, "<WMS_Capabilities version=\"2.0\"/>"), "2.0"));
  CHECK(has(fault_of(parse_wms_capabilities, saved("mapproxy_exception.xml")), "unknown layer: none (LayerNotDefined)"));
  CHECK(has(fault_of(parse_tms_resource, "<TileMap><SRS>EPSG:3857</SRS></TileMap>"), "BoundingBox"));
  CHECK(has(fault_of(parse_tms_resource, "<TileMapService><TileMaps><TileMap href=\"http://h/a\"/></TileMaps></TileMapService>"), "http://h/a"));
  CHECK(has(fault_of(parse_tms_resource, "<kml/>"), "<kml>"));
}

TEST_CASE("services: hostile XML is bounded") {
  std::string deep = "<WMS_Capabilities version=\"1.3.0\"><Capability>";
  for (int i = 0; i < 100'000; ++i) deep += "<Layer>";
  deep += "<Name>x</Name>";
  for (int i = 0; i < 100'000; ++i) deep += "</Layer>";
  deep += "</Capability></WMS_Capabilities>";
  CHECK(has(fault_of(parse_wms_capabilities, deep), "deep"));
  CHECK(has(fault_of(parse_wmts_capabilities, std::string(2'000'001, '<')), "two million"));
  CHECK(has(fault_of(parse_wmts_capabilities, std::string((std::size_t{64} << 20) + 1, ' ')), "MB"));
  // Entities are not expanded, files not read.
  const auto map = parse_tms_resource(R"(<!DOCTYPE TileMap [<!ENTITY a "bang"><!ENTITY f SYSTEM "file:///etc/passwd">]><TileMap><Title>&a;&f;</Title>
    <BoundingBox minx="1" miny="2" maxx="3" maxy="4"/><Origin x="1" y="2"/><TileFormat extension="png"/><TileSets><TileSet href="0" units-per-pixel="1" order="0"/></TileSets></TileMap>)");
  REQUIRE(map);
  CHECK(map->title == "&a;&f;");
}

TEST_CASE("service_exception: of WMS, of OWS, a page; and no false alarm") {
  CHECK(service_exception(saved("mapproxy_exception.xml")) == "unknown layer: none (LayerNotDefined)");
  CHECK(service_exception("<ows:ExceptionReport xmlns:ows='o'><ows:Exception exceptionCode='TileOutOfRange'/></ows:ExceptionReport>") == "TileOutOfRange");
  CHECK(service_exception("<ServiceExceptionReport><ServiceException>\n  two\n lines </ServiceException></ServiceExceptionReport>") == "two lines");
  CHECK(service_exception("<html><body>no</body></html>") == "a page of HTML");
  CHECK(!service_exception("\x89PNG\r\n"));
  CHECK(!service_exception("<svg/>"));
  CHECK(!service_exception(""));
}
