#include "source/tiles/cesium_layer.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::source;

namespace {

const std::string kUrl = "http://host:81/terrain/layer.json";

/// A layer with these members beside the format.
std::string layer(const std::string& members) { return R"({"format": "quantized-mesh-1.0", )" + members + "}"; }

std::string url_of(const std::string& members, const std::string& url = kUrl) {
  const auto parsed = parse_cesium_layer(layer(members), url);
  REQUIRE(parsed);
  return parsed->url;
}

ErrorCode code_of(const std::string& text) {
  const auto parsed = parse_cesium_layer(text, kUrl);
  REQUIRE_FALSE(parsed);
  CHECK_FALSE(parsed.error().message.empty());
  return parsed.error().code;
}

}  // namespace

TEST_CASE("parse_cesium_layer: a whole layer") {
  const auto parsed = parse_cesium_layer(R"({
      "tilejson": "2.1.0", "format": "heightmap-1.0", "version": "1.16.0", "scheme": "tms", "projection": "EPSG:4326",
      "tiles": ["{z}/{x}/{y}.terrain?v={version}"], "bounds": [-20, -10.5, 30, 40], "attribution": "Somebody",
      "available": [[{"startX": 0, "startY": 0, "endX": 1, "endY": 0}], [{"startX": 1, "startY": 1, "endX": 2, "endY": 1}]]})", kUrl);
  REQUIRE(parsed);
  CHECK(parsed->format == TerrainFormat::heightmap);
  CHECK_FALSE(parsed->mercator);
  CHECK(parsed->url == "http://host:81/terrain/{z}/{x}/{-y}.terrain?v=1.16.0");
  CHECK(parsed->min_zoom == 0);
  CHECK(parsed->max_zoom == 1);
  REQUIRE(parsed->bounds);
  CHECK(*parsed->bounds == std::array{-20.0, -10.5, 30.0, 40.0});
  CHECK(parsed->attribution == "Somebody");
  // Rows are listed from the south: row 1 there is row 0 of ours.
  CHECK(parsed->may_have({1, 1, 0}, 2));
  CHECK(parsed->may_have({1, 2, 0}, 2));
  CHECK_FALSE(parsed->may_have({1, 1, 1}, 2));
  CHECK_FALSE(parsed->may_have({1, 0, 0}, 2));
  CHECK_FALSE(parsed->may_have({2, 0, 0}, 4));
}

TEST_CASE("parse_cesium_layer: tiles are found from where the layer lies, with its key on the same server only") {
  CHECK(url_of(R"("tiles": ["{z}/{x}/{y}"])", "https://host") == "https://host/{z}/{x}/{-y}");
  CHECK(url_of(R"("tiles": ["{z}/{x}/{y}"])", "https://host/layer.json") == "https://host/{z}/{x}/{-y}");
  CHECK(url_of(R"("tiles": ["{z}/{x}/{y}"])", "https://host/a/layer.json?key=1/2") == "https://host/a/{z}/{x}/{-y}?key=1/2");
  CHECK(url_of(R"("tiles": ["{z}/{x}/{y}?v={version}"], "version": "2")", "https://host/a/layer.json?key=1#x") == "https://host/a/{z}/{x}/{-y}?v=2&key=1");
  CHECK(url_of(R"("tiles": ["/b/{z}/{x}/{y}"])", "https://user:word@host:8/a/layer.json?key=1") == "https://user:word@host:8/b/{z}/{x}/{-y}?key=1");
  CHECK(url_of(R"("tiles": ["//other/{z}/{x}/{y}"])", "https://host/a/layer.json?key=1") == "https://other/{z}/{x}/{-y}");
  CHECK(url_of(R"("tiles": ["http://other/{z}/{x}/{y}", "http://third/{z}/{x}/{y}"])", "https://host/a?key=1") == "http://other/{z}/{x}/{-y}");
  CHECK(url_of(R"("tiles": ["http://host/{z}/{x}/{y}"])", "https://host/a?key=1") == "http://host/{z}/{x}/{-y}");
  CHECK(url_of(R"("tiles": ["{z}/{x}/{y}"], "scheme": "slippyMap")") == "http://host:81/terrain/{z}/{x}/{y}");
}

TEST_CASE("parse_cesium_layer: where the levels begin") {
  const auto coarsest = [](const std::string& members) {
    const auto parsed = parse_cesium_layer(layer(R"("tiles": ["{z}/{x}/{y}"])" + members), kUrl);
    REQUIRE(parsed);
    return parsed->min_zoom;
  };
  CHECK(coarsest("") == 0);
  CHECK(coarsest(R"(, "minzoom": 3)") == 3);
  CHECK(coarsest(R"(, "minzoom": 0, "available": [[], [], [{"startX": 1, "startY": 1, "endX": 1, "endY": 1}]])") == 2);
}

TEST_CASE("parse_cesium_layer: how fine the tiles are") {
  const auto finest = [](const std::string& members) {
    const auto parsed = parse_cesium_layer(layer(R"("tiles": ["{z}/{x}/{y}"])" + members), kUrl);
    REQUIRE(parsed);
    return parsed->max_zoom;
  };
  const std::string one = R"([{"startX": 0, "startY": 0, "endX": 1, "endY": 0}])";
  CHECK(finest("") == std::nullopt);
  CHECK(finest(R"(, "maxzoom": 9)") == 9);
  CHECK(finest(R"(, "available": [)" + one + ", " + one + "]") == 1);
  CHECK(finest(R"(, "available": [)" + one + ", " + one + ", []]") == 1);
  CHECK(finest(R"(, "maxzoom": 9, "available": [)" + one + ", " + one + "]") == 1);
  CHECK(finest(R"(, "maxzoom": 9, "metadataAvailability": 10, "available": [)" + one + "]") == 9);
}

TEST_CASE("CesiumLayer::may_have: without a list everything may be there, and what tiles list themselves too") {
  const auto all = parse_cesium_layer(layer(R"("tiles": ["{z}/{x}/{y}"], "maxzoom": 5)"), kUrl);
  REQUIRE(all);
  CHECK(all->may_have({5, 63, 31}, 32));
  const auto more = parse_cesium_layer(
      layer(R"("tiles": ["{z}/{x}/{y}"], "scheme": "slippyMap", "metadataAvailability": 10, "available": [[{"startX": 0, "startY": 0, "endX": 0, "endY": 0}]])"), kUrl);
  REQUIRE(more);
  CHECK(more->may_have({0, 0, 0}, 1));
  CHECK_FALSE(more->may_have({0, 1, 0}, 1));
  CHECK(more->may_have({1, 3, 1}, 2));
}

TEST_CASE("parse_cesium_layer: bounds that cannot be used are left out") {
  for (const char* bounds : {"[170, -10, -170, 10]", "[1, 2, 3]", "[\"a\", 0, 1, 1]", "{}"}) {
    const auto parsed = parse_cesium_layer(layer(R"("tiles": ["{z}/{x}/{y}"], "bounds": )" + std::string(bounds)), kUrl);
    REQUIRE(parsed);
    CHECK_FALSE(parsed->bounds);
  }
}

TEST_CASE("parse_cesium_layer: what is wrong is refused") {
  for (const std::string text : {"", "[]", "no JSON", "{", "{\"format\": 1e999}"}) CHECK(code_of(text) == ErrorCode::corrupt);
  CHECK(code_of("{}") == ErrorCode::unsupported);
  CHECK(code_of(R"({"format": "quantized-mesh-2.0", "tiles": ["{z}/{x}/{y}"]})") == ErrorCode::unsupported);
  CHECK(code_of(layer(R"("tiles": ["{z}/{x}/{y}"], "projection": "EPSG:2056")")) == ErrorCode::unsupported);
  CHECK(code_of(layer(R"("tiles": ["{z}/{x}/{y}"], "scheme": "spiral")")) == ErrorCode::unsupported);
  CHECK(code_of(layer(R"("tiles": ["ftp://host/{z}/{x}/{y}"])")) == ErrorCode::unsupported);
  CHECK(code_of(layer(R"("tiles": [])")) == ErrorCode::corrupt);
  CHECK(code_of(layer(R"("tiles": ["a b"])")) == ErrorCode::corrupt);
  CHECK(code_of(layer(R"("tiles": [{"z": 1}])")) == ErrorCode::corrupt);
  for (const char* available : {"7", "[7]", "[[7]]", "[[{}]]", R"([[{"startX": -1, "startY": 0, "endX": 1, "endY": 0}]])", R"([[{"startX": 0.5, "startY": 0, "endX": 1, "endY": 0}]])"})
    CHECK(code_of(layer(R"("tiles": ["{z}/{x}/{y}"], "available": )" + std::string(available))) == ErrorCode::corrupt);
  std::string levels = "[[]";
  for (int i = 0; i < 40; ++i) levels += ", []";
  CHECK(code_of(layer(R"("tiles": ["{z}/{x}/{y}"], "available": )" + levels + "]")) == ErrorCode::exhausted);
}

TEST_CASE("parse_cesium_layer: those of a real server") {
  for (const char* name : {"QuantizedMesh", "OctVertexNormals", "WaterMask"}) {
    const std::string path = std::string(TELLURION_SHARED_DATA_DIR) + "/earth/tiles/quantized_mesh/" + name + ".tile.json";
    if (!std::filesystem::exists(path)) {
      MESSAGE("skipped: no " << path);
      continue;
    }
    std::ifstream stream(path, std::ios::binary);
    const auto parsed = parse_cesium_layer(std::string{std::istreambuf_iterator<char>(stream), {}}, kUrl);
    REQUIRE(parsed);
    CHECK(parsed->format == TerrainFormat::quantized_mesh);
    CHECK(parsed->url == "http://host:81/terrain/{z}/{x}/{-y}.terrain?v=1.0.0");
    CHECK(parsed->may_have({0, 1, 0}, 1));
  }
}
