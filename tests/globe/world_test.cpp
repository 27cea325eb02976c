#include "globe/world.h"

#include <filesystem>
#include <fstream>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::globe;

namespace {

constexpr const char* kWhole = R"(
[planet]
name = "Mars"

[[layer]]
name = "MOLA"
group = "height"
mode = "add"
source = { type = "gdal", path = "mola.tif", vertical = "ellipsoid", scale = 0.5, offset = -3.0, no_data = -9999 }

[[layer]]
group = "color"
source = { path = "../viking.tif", bands = [3, 2, 1], crs = "IAU_2015:49900" }
opacity = 0.5
gamma = 2
multiplier = 1.5
feather = 12.5
enabled = false
)";

std::string message_of(const std::string& text) {
  const auto world = parse_world(text, "/worlds", "w.toml");
  REQUIRE_FALSE(world);
  return world.error().message;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("parse_world: reads every key") {
  const auto world = parse_world(kWhole, "/worlds/mars", "w.toml");
  REQUIRE(world);
  CHECK(world->planet == "Mars");
  CHECK(world->ellipsoid == geo::kMars);
  REQUIRE(world->layers.size() == 2);
  const LayerSpec& height = world->layers[0];
  CHECK(height.group == LayerGroup::height);
  CHECK(height.adds);
  CHECK(height.source.path == "/worlds/mars/mola.tif");
  CHECK(height.source.vertical == "ellipsoid");
  CHECK(height.source.scale == 0.5);
  CHECK(height.source.offset == -3.0);
  CHECK(height.source.no_data == -9999.0);
  const LayerSpec& colour = world->layers[1];
  CHECK(colour.name == "viking");
  CHECK(colour.source.path == "/worlds/viking.tif");
  CHECK(*colour.source.bands == std::array{3, 2, 1});
  CHECK(colour.source.crs == "IAU_2015:49900");
  CHECK(colour.opacity == 0.5);
  CHECK(colour.gamma == 2.0);
  CHECK(colour.multiplier == 1.5);
  CHECK(colour.feather == 12.5);
  CHECK_FALSE(colour.enabled);
}

TEST_CASE("to_toml: parse_world gives the same world back") {
  auto world = parse_world(kWhole, "/worlds/mars", "w.toml");
  REQUIRE(world);
  world->file = "/worlds/mars/w.toml";
  const std::string text = to_toml(*world);
  const auto again = parse_world(text, "/worlds/mars", "again.toml");
  REQUIRE(again);
  auto placed = *again;
  placed.file = world->file;
  CHECK(to_toml(placed) == text);
  CHECK(again->layers[1].source.path == world->layers[1].source.path);
  CHECK(contains(text, "mola.tif"));
  CHECK_FALSE(contains(text, "/worlds/mars/mola.tif"));
}

TEST_CASE("parse_world: mistakes name the file and the line") {
  CHECK(contains(message_of("[planet]\nname = \"Vulcan\"\n"), "w.toml:2: no body is known as \"Vulcan\""));
  CHECK(contains(message_of("[planet]\nradius = 3\n"), "w.toml:2: [planet] has no key `radius`"));
  CHECK(contains(message_of("[planet]\nradii = [1, 2]\n"), "w.toml:2: `radii`"));
  CHECK(contains(message_of("\n\n[[layer]]\ngroup = \"heights\"\n"), "w.toml:4: no group is called \"heights\""));
  CHECK(contains(message_of("[[layer]]\ngroup = \"normal\"\ngamma = 2.0\nsource = { path = \"n.tif\" }\n"), "w.toml:3: normals have no `gamma`"));
  CHECK(contains(message_of("[[layer]]\ngroup = \"color\"\n"), "w.toml:1: the layer has no `source`"));
  CHECK(contains(message_of("[[layer]]\ngroup = \"color\"\nopacity = 2\nsource = { path = \"a\" }\n"), "w.toml:3: `opacity`"));
  CHECK(contains(message_of("[[layer]]\ngroup = \"color\"\nopacity = nan\nsource = { path = \"a\" }\n"), "w.toml:3: `opacity`"));
  CHECK(contains(message_of("[layer]\ngroup = \"color\"\n"), "two brackets"));
  CHECK(contains(message_of("[[layer]]\ngroup = \"color\"\nfeather = -1\nsource = { path = \"a\" }\n"), "w.toml:3: `feather` must be a number from 0 to 100000"));
  CHECK(contains(message_of("[[layer]]\ngroup = \n"), "w.toml:2: not valid TOML"));
  CHECK(contains(message_of("[[layer]]\ngroup = \"color\"\nsource = { type = \"wfs\", url = \"u\" }\n"), "\"wfs\""));
  const auto tiles = [](const std::string& more) {
    return message_of("[[layer]]\ngroup = \"height\"\nsource = { type = \"xyz\", url = \"http://h/{z}/{x}/{y}.png\"" + more + " }\n");
  };
  CHECK(contains(message_of("[[layer]]\ngroup = \"color\"\nsource = { type = \"xyz\", url = \"u\" }\n"), "w.toml:3: the source needs a `url`"));
  CHECK(contains(tiles(", encoding = \"morse\""), "w.toml:3: no encoding is called \"morse\""));
  CHECK(contains(tiles(", projection = \"flat\""), "`projection`"));
  CHECK(contains(tiles(", bounds = [3, 0, 1, 2]"), "`bounds`"));
  CHECK(contains(tiles(", headers = { A = \"b\\nc\" }"), "the header `A`"));
  CHECK(contains(tiles(", path = \"x\""), "no key `path`"));
}

TEST_CASE("to_toml: a source of tiles comes back with all that was said of it") {
  const std::string text =
      "[[layer]]\nname = \"dem\"\ngroup = \"height\"\nsource = { type = \"xyz\", url = \"https://{s}.host/{z}/{x}/{-y}.webp?key=1\", subdomains = [\"a\", \"b\"], "
      "headers = { Authorization = \"secret\" }, projection = \"geographic\", encoding = \"terrarium\", tile_size = 512, min_level = 1, max_level = 9, "
      "bounds = [-10.5, -20, 30, 40], vertical = \"egm96\" }\n";
  const auto first = parse_world(text, "/folder", "w.toml");
  REQUIRE(first);
  const auto second = parse_world(to_toml(*first), "/folder", "w.toml");
  REQUIRE(second);
  for (const World* world : {&*first, &*second}) {
    REQUIRE(world->layers.size() == 1);
    const SourceSpec& source = world->layers[0].source;
    CHECK(source.type == "xyz");
    CHECK(source.url == "https://{s}.host/{z}/{x}/{-y}.webp?key=1");
    CHECK(source.subdomains == std::vector<std::string>{"a", "b"});
    CHECK(source.headers.at("Authorization") == "secret");
    CHECK(source.projection == "geographic");
    CHECK(source.encoding == "terrarium");
    CHECK(source.tile_size == 512);
    CHECK(source.min_level == 1);
    CHECK(source.max_level == 9);
    CHECK(source.bounds == std::array<double, 4>{-10.5, -20, 30, 40});
    CHECK(source.vertical == "egm96");
  }
}

TEST_CASE("parse_world: terrain of a layer.json, and back") {
  const std::string text = "[[layer]]\ngroup = \"height\"\nsource = { type = \"cesium-terrain\", url = \"https://host/terrain/layer.json?token=1\"";
  const auto usual = parse_world(text + " }\n", "/folder", "w.toml");
  REQUIRE(usual);
  CHECK(usual->layers[0].name == "https://host/terrain/layer.json");
  CHECK(usual->layers[0].source.tile_size == kTerrainSize);
  CHECK(usual->layers[0].source.max_level == kEveryLevel);
  const auto said = parse_world(text + ", tile_size = 64, max_level = 9, vertical = \"egm96\", headers = { A = \"b\" } }\n", "/folder", "w.toml");
  REQUIRE(said);
  for (const World* world : {&*usual, &*said}) {
    const auto again = parse_world(to_toml(*world), "/folder", "w.toml");
    REQUIRE(again);
    const SourceSpec &before = world->layers[0].source, &after = again->layers[0].source;
    CHECK(after.type == "cesium-terrain");
    CHECK(after.url == before.url);
    CHECK(after.tile_size == before.tile_size);
    CHECK(after.max_level == before.max_level);
    CHECK(after.vertical == before.vertical);
    CHECK(after.headers == before.headers);
  }
  CHECK(said->layers[0].source.max_level == 9);
  CHECK(contains(message_of("[[layer]]\ngroup = \"height\"\nsource = { type = \"cesium-terrain\" }\n"), "w.toml:3: the source needs the `url` of a layer.json"));
  CHECK(contains(message_of(text + ", encoding = \"heightmap\" }\n"), "no key `encoding`"));
}

TEST_CASE("parse_world: tiles of heights may be meshes or heightmaps") {
  for (const std::string encoding : {"quantized-mesh", "heightmap", "centimetres"}) {
    const auto world = parse_world("[[layer]]\ngroup = \"height\"\nsource = { type = \"xyz\", url = \"http://h/{z}/{x}/{y}\", encoding = \"" + encoding + "\" }\n", "/folder", "w.toml");
    REQUIRE(world);
    CHECK(world->layers[0].source.encoding == encoding);
  }
}

TEST_CASE("parse_world: services, each with its own keys") {
  const auto source = [](const std::string& keys) { return message_of("[[layer]]\ngroup = \"color\"\nsource = { " + keys + " }\n"); };
  CHECK(contains(source("type = \"wmts\", url = \"http://h\", layers = \"a\""), "w.toml:3: source has no key `layers`"));
  CHECK(contains(source("type = \"wmts\", url = \"http://h\", attribution = \"a\""), "source has no key `attribution`, which the [[layer]] has; it knows type, "));
  CHECK(contains(source("type = \"wms\", url = \"http://h\", layer = \"a\""), "no key `layer`"));
  CHECK(contains(source("type = \"tms\", url = \"http://h\", style = \"a\""), "no key `style`"));
  CHECK(contains(source("type = \"wms\", url = \"http://h\", version = \"2.0\""), "1.3.0"));
  CHECK(contains(source("type = \"wmts\", url = \"h\""), "`url`"));
  CHECK(contains(source("type = \"wmts\", url = \"http://h\", dimensions = { Time = 3 }"), "`Time`"));
  CHECK(contains(source("type = \"wmts\", url = \"http://h\", dimensions = \"now\""), "dimensions"));
}

TEST_CASE("to_toml: services come back with all that was said of them") {
  const auto world = parse_world(
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"wmts\", url = \"https://host/caps.xml\", layer = \"a b\", style = \"s\", matrix_set = \"m\", "
      "format = \"image/png\", dimensions = { Time = \"2020\" }, headers = { Cookie = \"c\" }, max_level = 7 }\n"
      "[[layer]]\ngroup = \"height\"\nsource = { type = \"wms\", url = \"https://host/wms\", layers = \"a,b\", styles = \",x\", version = \"1.1.1\", crs = \"EPSG:3035\", "
      "transparent = false, tile_size = 512, encoding = \"terrarium\", min_level = 2, bounds = [0, 40, 20.5, 60], vertical = \"egm96\" }\n"
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"tms\", url = \"https://host/tms/\" }\n", "/worlds", "w.toml");
  REQUIRE(world);
  const auto again = parse_world(to_toml(*world), "/worlds", "again.toml");
  REQUIRE(again);
  for (const World* w : {&*world, &*again}) {
    const SourceSpec& wmts = w->layers[0].source;
    CHECK(wmts.type == "wmts");
    CHECK(wmts.service.layer == "a b");
    CHECK(wmts.service.style == "s");
    CHECK(wmts.service.matrix_set == "m");
    CHECK(wmts.service.format == "image/png");
    CHECK(wmts.service.dimensions.at("Time") == "2020");
    CHECK(wmts.headers.at("Cookie") == "c");
    CHECK(wmts.service.max_level == 7);
    CHECK(!wmts.service.min_level);
    const SourceSpec& wms = w->layers[1].source;
    CHECK(wms.service.layer == "a,b");
    CHECK(wms.service.style == ",x");
    CHECK(wms.service.version == "1.1.1");
    CHECK(wms.crs == "EPSG:3035");
    CHECK(wms.service.transparent == false);
    CHECK(wms.tile_size == 512);
    CHECK(wms.encoding == "terrarium");
    CHECK(wms.service.min_level == 2);
    CHECK(wms.bounds == std::array{0.0, 40.0, 20.5, 60.0});
    CHECK(wms.vertical == "egm96");
    CHECK(w->layers[2].source.url == "https://host/tms/");
    CHECK(w->layers[2].name == "https://host/tms/");
  }
}

TEST_CASE("to_toml: archives and remote rasters come back with all that was said of them") {
  const std::string text =
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"mbtiles\", path = \"a.mbtiles\" }\n"
      "[[layer]]\ngroup = \"height\"\nsource = { type = \"geopackage\", path = \"b.gpkg\", table = \"dem\", encoding = \"terrarium\", vertical = \"egm96\", bounds = [1, 2, 3, 4] }\n"
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"pmtiles\", url = \"https://h/c.pmtiles?key=1\", headers = { A = \"b\" } }\n"
      "[[layer]]\ngroup = \"height\"\nsource = { type = \"cog\", url = \"https://h/d.tif\", headers = { A = \"b\" }, crs = \"EPSG:3857\", no_data = -1, scale = 2, offset = 3, bands = [3, 2, 1] }\n";
  const auto first = parse_world(text, "/folder", "w.toml");
  REQUIRE(first);
  const auto second = parse_world(to_toml(*first), "/folder", "w.toml");
  REQUIRE(second);
  for (const World* world : {&*first, &*second}) {
    REQUIRE(world->layers.size() == 4);
    CHECK(world->layers[0].source.path == "/folder/a.mbtiles");
    CHECK(world->layers[0].name == "a");
    const SourceSpec& package = world->layers[1].source;
    CHECK(package.type == "geopackage");
    CHECK(package.table == "dem");
    CHECK(package.encoding == "terrarium");
    CHECK(package.vertical == "egm96");
    CHECK(package.bounds == std::array<double, 4>{1, 2, 3, 4});
    CHECK(world->layers[2].source.url == "https://h/c.pmtiles?key=1");
    CHECK(world->layers[2].source.headers.at("A") == "b");
    CHECK(world->layers[2].name == "https://h/c.pmtiles");
    const SourceSpec& cog = world->layers[3].source;
    CHECK(cog.type == "cog");
    CHECK(cog.crs == "EPSG:3857");
    CHECK(cog.no_data == -1.0);
    CHECK(cog.scale == 2.0);
    CHECK(cog.offset == 3.0);
    CHECK(cog.bands == std::array<int, 3>{3, 2, 1});
    CHECK(cog.path.empty());
  }
  const auto refused = [](const std::string& source) { return message_of("[[layer]]\ngroup = \"color\"\nsource = { " + source + " }\n"); };
  CHECK(contains(refused("type = \"mbtiles\", url = \"http://h/a.mbtiles\""), "no key `url`"));
  CHECK(contains(refused("type = \"mbtiles\""), "no `path`"));
  CHECK(contains(refused("type = \"pmtiles\", url = \"http://h/a\", path = \"a\""), "only one of them"));
  CHECK(contains(refused("type = \"pmtiles\", url = \"ftp://h/a\""), "http://"));
  CHECK(contains(refused("type = \"cog\", path = \"a.tif\""), "no key `path`"));
  CHECK(contains(refused("type = \"cog\", url = \"a.tif\""), "needs a `url`"));
}

TEST_CASE("parse_world: debug sources and pictures come back from what is written") {
  const std::string text =
      "[[layer]]\ngroup = \"overlay\"\nsource = { type = \"tile-index\", projection = \"geographic\", tile_size = 512 }\n"
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"scale\", unit = \"m\" }\n"
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"image\", path = \"a.png\", bounds = [170, -10, 190.5, 10] }\n"
      "[[layer]]\ngroup = \"color\"\nsource = { type = \"image\", path = \"b.png\" }\n";
  const auto first = parse_world(text, "/folder", "w.toml");
  REQUIRE(first);
  const auto second = parse_world(to_toml(*first), "/folder", "w.toml");
  REQUIRE(second);
  for (const World* world : {&*first, &*second}) {
    REQUIRE(world->layers.size() == 4);
    CHECK(world->layers[0].name == "tile-index");
    CHECK(world->layers[0].source.projection == "geographic");
    CHECK(world->layers[0].source.tile_size == 512);
    CHECK(world->layers[1].source.unit == "m");
    CHECK(world->layers[2].source.path == "/folder/a.png");
    CHECK(world->layers[2].source.bounds == std::array<double, 4>{170, -10, 190.5, 10});
    CHECK(world->layers[3].source.bounds == std::array<double, 4>{-180, -90, 180, 90});
  }
  const auto source = [](const std::string& group, const std::string& more) { return message_of("[[layer]]\ngroup = \"" + group + "\"\nsource = { type = " + more + " }\n"); };
  CHECK(contains(source("height", "\"scale\""), "is a picture"));
  CHECK(contains(source("color", "\"scale\", unit = \"mile\""), "`unit`"));
  CHECK(contains(source("color", "\"tile-index\", tile_size = 4"), "`tile_size`"));
  CHECK(contains(source("color", "\"tile-index\", path = \"x\""), "no key `path`"));
  CHECK(contains(source("color", "\"image\""), "no `path`"));
  CHECK(contains(source("color", "\"image\", path = \"x\", bounds = [-200, 0, 170, 10]"), "`bounds`"));
}

TEST_CASE("load_world: a file that is not there is named") {
  const auto world = load_world("/no/such/world.toml");
  REQUIRE_FALSE(world);
  CHECK(world.error().code == ErrorCode::not_found);
  CHECK(contains(world.error().message, "/no/such/world.toml"));
}

TEST_CASE("save_world: what is saved is loaded again") {
  const auto folder = std::filesystem::temp_directory_path() / "tellurion_world_test";
  std::filesystem::create_directories(folder);
  auto world = parse_world(kWhole, folder, "w.toml");
  REQUIRE(world);
  REQUIRE(save_world(*world, folder / "saved.toml"));
  const auto again = load_world(folder / "saved.toml");
  REQUIRE(again);
  CHECK(again->layers[0].source.path == world->layers[0].source.path);
  CHECK(again->planet == "Mars");
  const auto nowhere = save_world(*world, folder / "no" / "folder" / "w.toml");
  REQUIRE_FALSE(nowhere);
  CHECK(contains(nowhere.error().message, "w.toml"));
  std::filesystem::remove_all(folder);
}
