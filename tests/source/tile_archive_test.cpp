#include "source/tiles/tile_archive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <ogr_spatialref.h>

#include "fetch/little_server.h"
#include "source/made_archive.h"
#include "source/made_raster.h"
#include "source/tiles/archive_tile.h"

using namespace tellurion;
using namespace tellurion::source;
using test::Database;
using test::Folder;
using test::PmArchive;
using test::pm_directory;
using namespace std::chrono_literals;

namespace {

using Source = Result<std::unique_ptr<RasterSource>>;

TileArchive archive_at(const std::filesystem::path& file, SampleKind kind = SampleKind::colour) {
  TileArchive archive;
  archive.file = file;
  archive.kind = kind;
  return archive;
}

/// Reads until nothing is on its way.
template <class Read>
auto settled(RasterReader& reader, const Read& read) {
  for (;;) {
    auto data = read();
    if (data || data.error().code != ErrorCode::pending) return data;
    for (const auto& arrival : reader.take_awaited()) REQUIRE(arrival->wait_for(20s));
  }
}

/// Red, green and blue where the raster shows a place, degrees.
std::array<int, 3> colour_at(const Source& source, double latitude, double longitude) {
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  auto reader = (*source)->open_reader();
  REQUIRE(reader);
  const std::array<geo::LatLon, 1> place{geo::LatLon{to_radians(Degrees(latitude)), to_radians(Degrees(longitude))}};
  std::array<glm::dvec2, 1> pixel;
  (*reader)->to_pixels(place, pixel);
  const PixelWindow window{static_cast<int>(std::floor(pixel[0].x)), static_cast<int>(std::floor(pixel[0].y)), 1, 1};
  const auto image = settled(**reader, [&] { return (*reader)->read_colours(0, window); });
  REQUIRE_MESSAGE(image, (image ? "" : image.error().message));
  return {image->rgba[0], image->rgba[1], image->rgba[2]};
}

std::string message_of(const Source& source) {
  REQUIRE_FALSE(source);
  return source.error().message;
}

/// Four tiles of zoom 1: north-west red, north-east green, south-west blue, south-east grey.
const std::array<std::array<int, 3>, 4> kColours{{{200, 0, 0}, {0, 200, 0}, {0, 0, 200}, {99, 99, 99}}};
std::string tile_of(std::size_t i) { return test::plain_png(64, kColours[i][0], kColours[i][1], kColours[i][2]); }

void check_four(const Source& source) {
  CHECK(colour_at(source, 60, -90) == kColours[0]);
  CHECK(colour_at(source, 60, 90) == kColours[1]);
  CHECK(colour_at(source, -60, -90) == kColours[2]);
  CHECK(colour_at(source, -60, 90) == kColours[3]);
}

void make_mbtiles(const std::filesystem::path& file, bool view = false) {
  Database database(file);
  database.run("CREATE TABLE metadata (name TEXT, value TEXT); INSERT INTO metadata VALUES ('format', 'png'), ('bounds', '-180,-85,180,85'),"
               " ('attribution', '<a href=\"http://x\">Those who made it</a>')");
  if (view) {
    database.run("CREATE TABLE map (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_id TEXT); CREATE TABLE images (tile_id TEXT PRIMARY KEY, tile_data BLOB);"
                 "CREATE UNIQUE INDEX map_index ON map (zoom_level, tile_column, tile_row);"
                 "CREATE VIEW tiles AS SELECT zoom_level, tile_column, tile_row, tile_data FROM map JOIN images ON map.tile_id = images.tile_id");
  } else {
    database.run("CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_data BLOB); CREATE UNIQUE INDEX tile_index ON tiles (zoom_level, tile_column, tile_row)");
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t column = i % 2, row_from_south = 1 - i / 2;
    if (view) {
      database.run(fmt::format("INSERT INTO map VALUES (1, {}, {}, 't{}')", column, row_from_south, i));
      database.run(fmt::format("INSERT INTO images VALUES ('t{}', ?)", i), tile_of(i));
    } else {
      database.run(fmt::format("INSERT INTO tiles VALUES (1, {}, {}, ?)", column, row_from_south), tile_of(i));
    }
  }
}

PmArchive four_pmtiles() {
  PmArchive made{.root = {}, .min_zoom = 1, .max_zoom = 1};
  // Numbers 1 to 4 of zoom 1: north-west, south-west, south-east, north-east.
  std::vector<test::PmEntry> entries;
  std::uint64_t number = 1;
  for (const std::size_t i : {0u, 2u, 3u, 1u}) {
    const std::string tile = tile_of(i);
    entries.push_back({number++, 1, tile.size(), made.tiles.size()});
    made.tiles += tile;
  }
  made.root = pm_directory(entries);
  return made;
}

std::shared_ptr<fetch::ByteStore> store() {
  fetch::StoreOptions options;
  options.fetch.first_pause = 10ms;
  options.pause_after_failure = 10ms;
  return std::make_shared<fetch::ByteStore>(options);
}

}  // namespace

TEST_CASE("open_mbtiles: tiles lie where they should, out of a table or a view, and nothing is written beside the file") {
  const Folder folder("mbtiles");
  for (const bool view : {false, true}) {
    const auto file = folder / (view ? "a view ?#%.mbtiles" : "table.mbtiles");
    make_mbtiles(file, view);
    const auto before = folder.names();
    const Source source = open_mbtiles(archive_at(file), geo::kWgs84);
    check_four(source);
    CHECK((*source)->description().attribution == "Those who made it");
    CHECK_FALSE((*source)->description().is_remote);
    CHECK(to_degrees((*source)->description().bounds.north).value == doctest::Approx(85.0).epsilon(0.001));
    CHECK(folder.names() == before);
  }
}

TEST_CASE("open_mbtiles: an archive in write-ahead mode is read without a trace; one that is being written is refused") {
  const Folder folder("mbtiles_wal");
  const auto file = folder / "wal.mbtiles";
  make_mbtiles(file);
  {
    Database writer(file);
    writer.run("PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0; INSERT INTO metadata VALUES ('name', 'x')");
    CHECK(message_of(open_mbtiles(archive_at(file), geo::kWgs84)).find("-wal") != std::string::npos);
  }
  check_four(open_mbtiles(archive_at(file), geo::kWgs84));
  CHECK(folder.names().size() == 1);
}

TEST_CASE("open_mbtiles: what cannot be shown is said") {
  const Folder folder("mbtiles_bad");
  const auto message = [&](const std::string& name) { return message_of(open_mbtiles(archive_at(folder / name), geo::kWgs84)); };
  CHECK(message("none.mbtiles").find("no such file") != std::string::npos);
  test::write_file(folder / "text.mbtiles", std::string(5000, 'x'));
  CHECK(message("text.mbtiles").find("no SQLite database") != std::string::npos);
  test::write_file(folder / "empty.mbtiles", "");
  CHECK(message("empty.mbtiles").find("no MBTiles") != std::string::npos);
  Database(folder / "vector.mbtiles").run("CREATE TABLE metadata (name, value); CREATE TABLE tiles (zoom_level, tile_column, tile_row, tile_data);"
                                          "INSERT INTO metadata VALUES ('format', 'pbf'); INSERT INTO tiles VALUES (0, 0, 0, x'1f8b')");
  CHECK(message("vector.mbtiles").find("vector tiles") != std::string::npos);
  Database(folder / "silent.mbtiles").run("CREATE TABLE tiles (zoom_level, tile_column, tile_row, tile_data); INSERT INTO tiles VALUES (0, 0, 0, x'1f8b0800')");
  CHECK(message("silent.mbtiles").find("vector tiles") != std::string::npos);
  Database(folder / "odd.mbtiles").run("CREATE TABLE tiles (a, b)");
  CHECK(message("odd.mbtiles").find("zoom_level") != std::string::npos);
  Database(folder / "bare.mbtiles").run("CREATE TABLE tiles (zoom_level, tile_column, tile_row, tile_data)");
  CHECK(message("bare.mbtiles").find("no tiles") != std::string::npos);
  Database(folder / "endless.mbtiles").run("CREATE VIEW tiles AS WITH RECURSIVE r(zoom_level) AS (SELECT 0 UNION ALL SELECT zoom_level + 1 FROM r)"
                                           " SELECT zoom_level, 0 AS tile_column, 0 AS tile_row, x'00' AS tile_data FROM r");
  CHECK_FALSE(message("endless.mbtiles").empty());
  Database(folder / "large.mbtiles").run("CREATE VIEW tiles AS SELECT 0 AS zoom_level, 0 AS tile_column, 0 AS tile_row, zeroblob(900000000) AS tile_data");
  CHECK_FALSE(message("large.mbtiles").empty());
  // A product of tables that takes for ever.
  Database(folder / "product.mbtiles").run("CREATE TABLE n (v); INSERT INTO n VALUES (1), (2), (3), (4), (5), (6), (7), (8), (9), (10);"
      "CREATE VIEW tiles AS SELECT a.v AS zoom_level, 0 AS tile_column, 0 AS tile_row, x'00' AS tile_data FROM n a, n b, n c, n d, n e, n f, n g, n h, n i, n j, n k, n l");
  CHECK(message("product.mbtiles").find("too long") != std::string::npos);
  // A few steps, each of which looks through a long text.
  Database(folder / "slow.mbtiles").run("CREATE TABLE n (v); INSERT INTO n VALUES (1), (2), (3), (4), (5), (6), (7), (8), (9), (10); CREATE TABLE long (t); INSERT INTO long VALUES (hex(zeroblob(500000)));"
      "CREATE VIEW tiles AS SELECT a.v AS zoom_level, 0 AS tile_column, 0 AS tile_row, x'00' AS tile_data FROM n a, n b, n c, n d, n e, n f, long WHERE t LIKE '%0' || b.v || c.v || d.v || e.v || f.v || '1'");
  const auto start = std::chrono::steady_clock::now();
  CHECK(message("slow.mbtiles").find("too long") != std::string::npos);
  CHECK(std::chrono::steady_clock::now() - start < 60s);
}

TEST_CASE("open_mbtiles: texts of a UTF-16 database are read") {
  const Folder folder("mbtiles_utf16");
  const auto file = folder / "wide.mbtiles";
  Database(file).run("PRAGMA encoding = 'UTF-16'; CREATE TABLE first (x)");
  make_mbtiles(file);
  const Source source = open_mbtiles(archive_at(file), geo::kWgs84);
  check_four(source);
  CHECK((*source)->description().attribution == "Those who made it");
  CHECK(to_degrees((*source)->description().bounds.north).value == doctest::Approx(85.0).epsilon(0.001));
  Database(file).run("UPDATE metadata SET value = 'pbf' WHERE name = 'format'");
  CHECK(message_of(open_mbtiles(archive_at(file), geo::kWgs84)).find("(pbf)") != std::string::npos);
}

TEST_CASE("open_mbtiles: damaged files are refused or read, never more") {
  const Folder folder("mbtiles_damaged");
  make_mbtiles(folder / "good.mbtiles");
  std::ifstream stream(folder / "good.mbtiles", std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(stream)), {});
  std::minstd_rand random(7);
  for (int round = 0; round < 60; ++round) {
    std::string bytes = good;
    if (round % 3 == 0) bytes.resize(random() % bytes.size());
    for (int i = 0; i < 20 && !bytes.empty(); ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
    const auto file = folder / fmt::format("{}.mbtiles", round);
    test::write_file(file, bytes);
    const Source source = open_mbtiles(archive_at(file), geo::kWgs84);
    if (!source) {
      CHECK(source.error().message.find(file.string()) != std::string::npos);
      continue;
    }
    auto reader = (*source)->open_reader();
    REQUIRE(reader);
    const auto& full = (*source)->description().levels.front();
    const auto image = (*reader)->read_colours(0, {0, 0, std::min(full.width, 128), std::min(full.height, 128)});
    CHECK((image || !image.error().message.empty()));
  }
}

TEST_CASE("open_mbtiles: a damaged tile is told as corrupt, which is not asked for again") {
  const Folder folder("mbtiles_tile");
  const auto file = folder / "a.mbtiles";
  make_mbtiles(file);
  Database(file).run("UPDATE tiles SET tile_data = x'89504e470d0a1a0a00' WHERE tile_column = 1 AND tile_row = 1");
  const Source source = open_mbtiles(archive_at(file), geo::kWgs84);
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  auto reader = (*source)->open_reader();
  REQUIRE(reader);
  const auto image = (*reader)->read_colours(0, {100, 30, 1, 1});
  REQUIRE_FALSE(image);
  CHECK(image.error().code == ErrorCode::corrupt);
}

TEST_CASE("plain_text: tags and control characters go, and whole characters stay") {
  CHECK(plain_text("<a href=\"x\">A</a>\tB\x7f") == "AB");
  CHECK(plain_text("\u0439\u009b\u00e9") == "\u0439\u00e9");
  for (const char* letter : {"\u0439", "\u6c34", "\U0001f30d"}) {
    const std::string one = letter;
    std::string text;
    while (text.size() <= 600) text += one;
    const std::string cut = plain_text(text);
    CHECK(cut.size() == 500 / one.size() * one.size());
    CHECK(text.starts_with(cut));
    CHECK(plain_text("a" + text).size() == 1 + 499 / one.size() * one.size());
  }
  CHECK(plain_text(std::string(600, 'x')).size() == 500);
  CHECK(plain_text(std::string(500, 'x')).size() == 500);
}

TEST_CASE("open_geopackage: heights in UTM as GDAL wrote them, with a scale per tile and without") {
  const Folder folder("gpkg");
  GDALAllRegister();
  for (const GDALDataType type : {GDT_Float32, GDT_Int16}) {
    const auto file = folder / fmt::format("{}.gpkg", GDALGetDataTypeName(type));
    constexpr int kWidth = 300, kHeight = 200;
    std::vector<float> wanted(kWidth * kHeight);
    for (int i = 0; i < kWidth * kHeight; ++i) wanted[static_cast<std::size_t>(i)] = static_cast<float>(100 + (i % kWidth) * 3 - (i / kWidth) * 2);
    if (type == GDT_Float32) wanted[5] = -9999.0f;
    {
      GDALDatasetUniquePtr memory(GetGDALDriverManager()->GetDriverByName("MEM")->Create("", kWidth, kHeight, 1, type, nullptr));
      std::array<double, 6> transform{500'000, 30, 0, 5'000'000, 0, -30};
      memory->SetGeoTransform(transform.data());
      OGRSpatialReference crs;
      crs.importFromEPSG(32633);
      memory->SetSpatialRef(&crs);
      if (type == GDT_Float32) memory->GetRasterBand(1)->SetNoDataValue(-9999.0);
      REQUIRE(memory->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, kWidth, kHeight, wanted.data(), kWidth, kHeight, GDT_Float32, 0, 0, nullptr) == CE_None);
      GDALDatasetUniquePtr copy(GetGDALDriverManager()->GetDriverByName("GPKG")->CreateCopy(file.c_str(), memory.get(), FALSE, nullptr, nullptr, nullptr));
      REQUIRE(copy);
    }
    TileArchive archive = archive_at(file, SampleKind::height);
    archive.vertical = "ellipsoid";
    const Source source = open_geopackage(archive, geo::kWgs84);
    REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
    auto reader = (*source)->open_reader();
    REQUIRE(reader);
    const auto grid = (*reader)->read_heights(0, {0, 0, kWidth, kHeight});
    REQUIRE(grid);
    double worst = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (type == GDT_Float32 && i == 5) CHECK(std::isnan(grid->metres[i]));
      else worst = std::max(worst, std::abs(static_cast<double>(grid->metres[i]) - static_cast<double>(wanted[i])));
    }
    CHECK(worst < 1e-3);
    // The pixel in the middle lies where the transform says: GDAL transforms 504500 E 4997000 N of UTM 33 to this.
    OGRSpatialReference from, to;
    from.importFromEPSG(32633);
    to.importFromEPSG(4326);
    from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    to.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const std::unique_ptr<OGRCoordinateTransformation> transformation(OGRCreateCoordinateTransformation(&from, &to));
    double x = 504'500, y = 4'997'000;
    REQUIRE(transformation->Transform(1, &x, &y));
    const std::array<geo::LatLon, 1> place{geo::LatLon{to_radians(Degrees(y)), to_radians(Degrees(x))}};
    std::array<glm::dvec2, 1> pixel;
    (*reader)->to_pixels(place, pixel);
    CHECK(pixel[0].x == doctest::Approx(150.0).epsilon(1e-6));
    CHECK(pixel[0].y == doctest::Approx(100.0).epsilon(1e-6));
    CHECK(message_of(open_geopackage(archive_at(file), geo::kWgs84)).find("group = \"height\"") != std::string::npos);
    CHECK(folder.names().size() == (type == GDT_Float32 ? 1u : 2u));
  }
}

TEST_CASE("open_geopackage: heights in feet, at cells' corners, and in no length") {
  const Folder folder("gpkg_unit");
  GDALAllRegister();
  const auto file = folder / "feet.gpkg";
  {
    GDALDatasetUniquePtr memory(GetGDALDriverManager()->GetDriverByName("MEM")->Create("", 8, 8, 1, GDT_Float32, nullptr));
    std::array<double, 6> transform{500'000, 30, 0, 5'000'000, 0, -30};
    memory->SetGeoTransform(transform.data());
    OGRSpatialReference crs;
    crs.importFromEPSG(32633);
    memory->SetSpatialRef(&crs);
    REQUIRE(memory->GetRasterBand(1)->Fill(1000.0) == CE_None);
    GDALDatasetUniquePtr copy(GetGDALDriverManager()->GetDriverByName("GPKG")->CreateCopy(file.c_str(), memory.get(), FALSE, nullptr, nullptr, nullptr));
    REQUIRE(copy);
  }
  const auto declare = [&](const std::string& column, const std::string& value) {
    Database(file).run(fmt::format("UPDATE gpkg_2d_gridded_coverage_ancillary SET {} = '{}'", column, value));
  };
  TileArchive archive = archive_at(file, SampleKind::height);
  archive.vertical = "ellipsoid";
  const auto height = [&] {
    const Source source = open_geopackage(archive, geo::kWgs84);
    REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
    auto reader = (*source)->open_reader();
    REQUIRE(reader);
    return (*reader)->read_heights(0, {3, 3, 1, 1}).value().metres.front();
  };
  CHECK(height() == 1000.0f);
  declare("uom", "ft");
  CHECK(height() == doctest::Approx(304.8));
  declare("uom", "http://www.opengis.net/def/uom/UCUM/[ft_us]");
  CHECK(height() == doctest::Approx(304.800610));
  declare("uom", "furlong");
  CHECK(height() == 1000.0f);
  CHECK(open_geopackage(archive, geo::kWgs84).value()->description().hints.size() == 1);
  declare("uom", "m");
  CHECK(open_geopackage(archive, geo::kWgs84).value()->description().hints.empty());
  declare("grid_cell_encoding", "grid-value-is-corner");
  CHECK(open_geopackage(archive, geo::kWgs84).value()->description().hints.size() == 1);
}

TEST_CASE("open_geopackage: one of several tables, and what cannot be shown is said") {
  const Folder folder("gpkg_tables");
  GDALAllRegister();
  const auto file = folder / "two.gpkg";
  for (const bool second : {false, true}) {
    GDALDatasetUniquePtr memory(GetGDALDriverManager()->GetDriverByName("MEM")->Create("", 256, 256, 3, GDT_Byte, nullptr));
    std::array<double, 6> transform{second ? 20.0 : 10.0, 0.01, 0, 50, 0, -0.01};
    memory->SetGeoTransform(transform.data());
    OGRSpatialReference crs;
    crs.importFromEPSG(4326);
    memory->SetSpatialRef(&crs);
    memory->GetRasterBand(1)->Fill(second ? 200 : 100);
    std::vector<const char*> options{second ? "RASTER_TABLE=second" : "RASTER_TABLE=first", "TILE_FORMAT=PNG", second ? "APPEND_SUBDATASET=YES" : nullptr, nullptr};
    GDALDatasetUniquePtr copy(GetGDALDriverManager()->GetDriverByName("GPKG")->CreateCopy(file.c_str(), memory.get(), FALSE, options.data(), nullptr, nullptr));
    REQUIRE(copy);
  }
  TileArchive archive = archive_at(file);
  const std::string which = message_of(open_geopackage(archive, geo::kWgs84));
  CHECK(which.find("\"first\"") != std::string::npos);
  CHECK(which.find("\"second\"") != std::string::npos);
  archive.table = "third";
  CHECK(message_of(open_geopackage(archive, geo::kWgs84)).find("third") != std::string::npos);
  archive.table = "first";
  CHECK(colour_at(open_geopackage(archive, geo::kWgs84), 49, 11)[0] == 100);
  archive.table = "second";
  CHECK(colour_at(open_geopackage(archive, geo::kWgs84), 49, 21)[0] == 200);
  const auto bounds = open_geopackage(archive, geo::kWgs84).value()->description().bounds;
  CHECK(to_degrees(bounds.west).value == doctest::Approx(20.0));
  CHECK(to_degrees(bounds.south).value == doctest::Approx(47.44));

  const auto message = [&](const std::string& name) { return message_of(open_geopackage(archive_at(folder / name), geo::kWgs84)); };
  test::write_file(folder / "text.gpkg", std::string(5000, 'x'));
  CHECK(message("text.gpkg").find("no SQLite database") != std::string::npos);
  Database(folder / "other.gpkg").run("CREATE TABLE x (y)");
  CHECK(message("other.gpkg").find("no GeoPackage") != std::string::npos);
  Database(folder / "flood.gpkg").run("CREATE TABLE n (v); INSERT INTO n VALUES (1), (2), (3), (4), (5), (6), (7), (8), (9), (10); CREATE TABLE long (t); INSERT INTO long VALUES (hex(zeroblob(500000)));"
      "CREATE VIEW gpkg_contents AS SELECT t AS table_name, 'tiles' AS data_type, 0 AS min_x, 0 AS min_y, 1 AS max_x, 1 AS max_y FROM n a, n b, long");
  const Source flood = open_geopackage(archive_at(folder / "flood.gpkg"), geo::kWgs84);
  CHECK(message_of(flood).find("32 MB") != std::string::npos);
  CHECK(flood.error().code == ErrorCode::exhausted);
  if (const auto cities = test::shared_data("earth/archives/cities.gpkg"))
    CHECK(message_of(open_geopackage(archive_at(*cities), geo::kWgs84)).find("no tiles") != std::string::npos);
  Database(file).run("DROP TRIGGER gpkg_tile_matrix_pixel_x_size_update; UPDATE gpkg_tile_matrix SET pixel_x_size = -1 WHERE table_name = 'second'");
  CHECK(message_of(open_geopackage(archive, geo::kWgs84)).find("impossible") != std::string::npos);
}

TEST_CASE("open_pmtiles: tiles of a file, and out of directories in directories") {
  const Folder folder("pmtiles");
  PmArchive flat = four_pmtiles();
  flat.metadata = R"({"attribution": "\u00a9 <b>Those</b>", "name": [1]})";
  test::write_file(folder / "flat.pmtiles", flat.bytes());
  const Source source = open_pmtiles(archive_at(folder / "flat.pmtiles"), geo::kWgs84, nullptr);
  check_four(source);
  CHECK((*source)->description().attribution == "\u00a9 Those");
  CHECK_FALSE((*source)->description().is_remote);

  PmArchive deep = flat;
  std::string below = flat.root;
  for (int depth = 2; depth <= 4; ++depth) {
    deep.root = pm_directory({{1, 0, below.size(), deep.leaves.size()}});
    deep.leaves += below;
    below = deep.root;
  }
  test::write_file(folder / "deep.pmtiles", deep.bytes());
  check_four(open_pmtiles(archive_at(folder / "deep.pmtiles"), geo::kWgs84, nullptr));

  deep.leaves += below;
  deep.root = pm_directory({{1, 0, below.size(), deep.leaves.size() - below.size()}});
  test::write_file(folder / "deeper.pmtiles", deep.bytes());
  CHECK(message_of(open_pmtiles(archive_at(folder / "deeper.pmtiles"), geo::kWgs84, nullptr)).find("deep") != std::string::npos);

  PmArchive cyclic = flat;
  cyclic.leaves = pm_directory({{1, 0, 5, 0}});
  cyclic.root = cyclic.leaves;
  REQUIRE(cyclic.leaves.size() == 5);
  test::write_file(folder / "cyclic.pmtiles", cyclic.bytes());
  CHECK(message_of(open_pmtiles(archive_at(folder / "cyclic.pmtiles"), geo::kWgs84, nullptr)).find("deep") != std::string::npos);

  test::write_file(folder / "cut.pmtiles", flat.bytes().substr(0, flat.bytes().size() - 100));
  CHECK(message_of(open_pmtiles(archive_at(folder / "cut.pmtiles"), geo::kWgs84, nullptr)).find("cut off") != std::string::npos);
  PmArchive vector = flat;
  vector.type = 0;
  vector.tiles.replace(0, 4, "\x1f\x8b\x08\x00", 4);
  test::write_file(folder / "vector.pmtiles", vector.bytes());
  CHECK(message_of(open_pmtiles(archive_at(folder / "vector.pmtiles"), geo::kWgs84, nullptr)).find("vector") != std::string::npos);
}

TEST_CASE("open_pmtiles: from a server, each part once; directories arrive on demand") {
  PmArchive made = four_pmtiles();
  // The first tile stands in the root, the others in a directory far behind.
  const std::string others = pm_directory([&] {
    std::vector<test::PmEntry> entries;
    std::uint64_t number = 2, at = tile_of(0).size();
    for (const std::size_t i : {2u, 3u, 1u}) {
      entries.push_back({number++, 1, tile_of(i).size(), at});
      at += tile_of(i).size();
    }
    return entries;
  }());
  made.leaves = std::string(20'000, '\0') + others;
  made.root = pm_directory({{1, 1, tile_of(0).size(), 0}, {2, 0, others.size(), 20'000}});
  const std::string file = made.bytes();
  std::mutex mutex;
  std::vector<std::string> ranges;
  bool seen_header = true;
  const test::LittleServer server([&](const test::Ask& ask) {
    const std::size_t at = ask.headers.find("Range: ");
    {
      std::lock_guard lock(mutex);
      ranges.push_back(at == std::string::npos ? "" : ask.headers.substr(at, ask.headers.find('\r', at) - at));
      seen_header = seen_header && ask.headers.find("X-Key: sesame\r\n") != std::string::npos;
    }
    if (ask.path == "/gone.pmtiles") return test::Say{.status = 404};
    if (ask.path == "/whole.pmtiles") return test::Say{.body = file};
    return test::part_of(file, ask, "\"1\"");
  });
  const auto shared = store();
  TileArchive archive;
  archive.headers = {"X-Key: sesame"};
  archive.url = server.url("/a.pmtiles?token=secret");
  const Source source = open_pmtiles(archive, geo::kWgs84, shared);
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  CHECK((*source)->description().is_remote);
  CHECK((*source)->description().name.find("secret") == std::string::npos);
  CHECK(ranges.size() == 2);  // the head and the first tile
  check_four(source);
  check_four(source);
  CHECK(ranges.size() == 6);  // the directory and three tiles
  std::sort(ranges.begin(), ranges.end());
  CHECK(std::adjacent_find(ranges.begin(), ranges.end()) == ranges.end());
  CHECK(seen_header);
  archive.url = server.url("/gone.pmtiles");
  CHECK(open_pmtiles(archive, geo::kWgs84, shared).error().code == ErrorCode::not_found);
  archive.url = server.url("/whole.pmtiles");
  CHECK(message_of(open_pmtiles(archive, geo::kWgs84, shared)).find("ranges") != std::string::npos);
}

TEST_CASE("open_pmtiles and open_mbtiles: archives as others made them") {
  if (const auto file = test::shared_data("earth/archives/bluemarble-merc.pmtiles")) {
    const Source source = open_pmtiles(archive_at(*file), geo::kWgs84, nullptr);
    const std::array<int, 3> sea = colour_at(source, 0, -140), sand = colour_at(source, 23, 10);
    CHECK(sea[2] > sea[0]);
    CHECK(sand[0] > 1.5 * sand[2]);
  }
  if (const auto file = test::shared_data("earth/archives/honolulu.mbtiles"))
    CHECK(message_of(open_mbtiles(archive_at(*file), geo::kWgs84)).find("vector tiles") != std::string::npos);
}
