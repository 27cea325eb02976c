#include "source/tiles/cesium_terrain.h"

#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>

#include <doctest/doctest.h>

#include "fetch/little_server.h"

using namespace tellurion;
using namespace tellurion::source;
using tellurion::test::Ask;
using tellurion::test::LittleServer;
using tellurion::test::Say;

namespace {

/// A heightmap of `metres` everywhere.
std::string flat_tile(int metres) {
  const int fifths = (metres + 1000) * 5;
  std::string tile;
  for (int i = 0; i < 65 * 65; ++i) tile += {static_cast<char>(fifths & 255), static_cast<char>(fifths >> 8)};
  return tile + std::string("\x0f\0", 2);
}

/// Serves a layer of three levels, of which only the north western quarter of the last is there; heights are the tile's level, column
/// and row from the south: level * 100 + column * 10 + row.
Say serve(const Ask& ask, const std::string& layer) {
  const std::string path = ask.path.substr(0, ask.path.find('?'));
  if (path == "/terrain/layer.json") return {.body = layer, .headers = {"Content-Type: application/json"}};
  int level = 0, column = 0, row = 0;
  if (std::sscanf(path.c_str(), "/terrain/%d/%d/%d.terrain", &level, &column, &row) != 3) return {.status = 404};
  return {.body = flat_tile(level * 100 + column * 10 + row)};
}

constexpr const char* kLayer = R"({"format": "heightmap-1.0", "scheme": "tms", "version": "7", "tiles": ["{z}/{x}/{y}.terrain?v={version}"],
    "attribution": "The surveyors", "available": [[{"startX": 0, "startY": 0, "endX": 1, "endY": 0}],
    [{"startX": 0, "startY": 0, "endX": 3, "endY": 1}], [{"startX": 0, "startY": 2, "endX": 3, "endY": 3}]]})";

std::shared_ptr<fetch::ByteStore> made_store() {
  fetch::StoreOptions options;
  options.fetch.first_pause = std::chrono::milliseconds(10);
  return std::make_shared<fetch::ByteStore>(options);
}

/// Reads until everything is there.
raster::HeightGrid read(RasterReader& reader, int level, const PixelWindow& window) {
  for (int round = 0; round < 20; ++round) {
    auto grid = reader.read_heights(level, window);
    if (grid) return *grid;
    REQUIRE(grid.error().code == ErrorCode::pending);
    for (const auto& arrival : reader.take_awaited()) arrival->wait({});
  }
  FAIL("it never came");
  return {};
}

std::string failure(const std::string& layer, CesiumTerrain terrain = {}) {
  const LittleServer server([&](const Ask& ask) { return serve(ask, layer); });
  terrain.url = server.url("/terrain/layer.json?token=sesame");
  const auto source = open_cesium_terrain(terrain, geo::kWgs84, made_store());
  REQUIRE_FALSE(source);
  CHECK(source.error().message.find("/terrain/layer.json") != std::string::npos);
  CHECK(source.error().message.find("sesame") == std::string::npos);
  return source.error().message;
}

}  // namespace

TEST_CASE("open_cesium_terrain: tiles lie where the layer says, and those that it does not list are not asked for") {
  std::atomic<bool> accepts{true};
  const LittleServer server([&](const Ask& ask) {
    if (ask.path.find(".terrain") != std::string::npos && ask.headers.find("Accept: application/vnd.quantized-mesh,application/octet-stream;q=0.9") == std::string::npos) accepts = false;
    return serve(ask, kLayer);
  });
  CesiumTerrain terrain;
  terrain.url = server.url("/terrain/layer.json?token=sesame");
  const auto source = open_cesium_terrain(terrain, geo::kWgs84, made_store());
  REQUIRE(source);
  const RasterDescription& about = (*source)->description();
  CHECK(about.kind == SampleKind::height);
  CHECK(about.levels.front().width == 8 * 128);
  CHECK(about.levels.front().height == 4 * 128);
  CHECK(about.attribution == "The surveyors");
  CHECK(about.vertical == "ellipsoid");
  CHECK(about.hints.empty());
  CHECK(about.name.find("sesame") == std::string::npos);
  const auto reader = (*source)->open_reader();
  REQUIRE(reader);
  // The third tile from the west in the northernmost row: row 3 from the south.
  CHECK(read(**reader, 0, {2 * 128 + 7, 9, 4, 4}).at(2, 2) == doctest::Approx(200 + 20 + 3));
  CHECK(server.asked("/terrain/2/2/3.terrain?v=7&token=sesame") == 1);
  // In the south east level 2 has none: level 1 stands in.
  CHECK(read(**reader, 0, {6 * 128 + 7, 3 * 128 + 9, 4, 4}).at(2, 2) == doctest::Approx(100 + 30 + 0));
  CHECK(server.asked("/terrain/2/6/0.terrain?v=7&token=sesame") == 0);
  CHECK(server.asked("/terrain/1/3/0.terrain?v=7&token=sesame") == 1);
  CHECK(server.asked("/terrain/layer.json?token=sesame") == 1);
  CHECK(accepts);
}

TEST_CASE("open_cesium_terrain: a parent is told of, since its tiles are not read") {
  const LittleServer server([&](const Ask& ask) { return serve(ask, R"({"parentUrl": "../world/layer.json?key=secret", )" + std::string(kLayer).substr(1)); });
  CesiumTerrain terrain;
  terrain.url = server.url("/terrain/layer.json?token=sesame");
  const auto source = open_cesium_terrain(terrain, geo::kWgs84, made_store());
  REQUIRE(source);
  REQUIRE((*source)->description().hints.size() == 1);
  const std::string& hint = (*source)->description().hints.front();
  CHECK(hint.find("/world/layer.json") != std::string::npos);
  CHECK(hint.find("secret") == std::string::npos);
  CHECK(hint.find("sesame") == std::string::npos);
}

TEST_CASE("open_cesium_terrain: headers go to the layer's own server only") {
  for (const bool elsewhere : {false, true}) {
    std::atomic<int> with{0}, without{0};
    const auto count = [&](const Ask& ask) {
      if (ask.path.find(".terrain") == std::string::npos) return;
      ++(ask.headers.find("Authorization: Bearer barley") != std::string::npos ? with : without);
      CHECK(ask.headers.find("Accept: application/vnd.quantized-mesh") != std::string::npos);
    };
    const LittleServer other([&](const Ask& ask) { return count(ask), serve(ask, ""); });
    std::string layer = kLayer;
    if (elsewhere) layer.replace(layer.find("{z}"), 0, other.url("/terrain/"));
    const LittleServer server([&](const Ask& ask) { return count(ask), serve(ask, layer); });
    CesiumTerrain terrain;
    terrain.url = server.url("/terrain/layer.json");
    terrain.headers = {"Authorization: Bearer barley"};
    const auto source = open_cesium_terrain(terrain, geo::kWgs84, made_store());
    REQUIRE(source);
    const auto reader = (*source)->open_reader();
    REQUIRE(reader);
    CHECK(read(**reader, 0, {2 * 128 + 7, 9, 4, 4}).at(2, 2) == doctest::Approx(200 + 20 + 3));
    CHECK((with > 0) != elsewhere);
    CHECK((without > 0) == elsewhere);
  }
}

TEST_CASE("open_cesium_terrain: max_zoom leaves finer levels out") {
  const LittleServer server([&](const Ask& ask) { return serve(ask, kLayer); });
  CesiumTerrain terrain{.url = server.url("/terrain/layer.json"), .headers = {}, .tile_size = 64, .max_zoom = 1, .vertical = {}};
  const auto source = open_cesium_terrain(terrain, geo::kWgs84, made_store());
  REQUIRE(source);
  CHECK((*source)->description().levels.front().width == 4 * 64);
}

TEST_CASE("open_cesium_terrain: what is wrong with the layer is said") {
  CHECK(failure("<html>") .find("is no layer.json") != std::string::npos);
  CHECK(failure(R"({"format": "heightmap-1.0", "tiles": ["{z}/{x}/{y}"]})").find("max_level") != std::string::npos);
  CHECK(failure(R"({"format": "heightmap-1.0", "tiles": ["{z}/{x}/{w}"], "maxzoom": 3})").find("{w}") != std::string::npos);
  CHECK(failure(R"({"format": "mesh", "tiles": ["{z}/{x}/{y}"]})").find("quantized-mesh-1.0") != std::string::npos);
}
