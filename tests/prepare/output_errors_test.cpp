#include "prepare/gdal/output_errors.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"
#include "surface/error_scan.h"
#include "surface/prepared_table.h"

using namespace tellurion;
using surface::ErrorTable;

namespace {

/// Rough ground, with a hole.
test::MadeRaster rough_ground(int width = 300, int height = 260) {
  test::MadeRaster made;
  made.width = width, made.height = height;
  made.type = GDT_Float32;
  made.no_data = -9999;
  made.transform = {{10, 0.01, 0, 50, 0, -0.01}};
  made.values.emplace_back();
  for (int y = 0; y < made.height; ++y) {
    for (int x = 0; x < made.width; ++x) {
      const bool hole = x >= 200 && x < 220 && y >= 30 && y < 50;
      made.values[0].push_back(hole ? -9999 : 900 + 400 * std::sin(x / 9.0) * std::cos(y / 7.0) + (x * 7919 + y * 104729) % 97);
    }
  }
  return made;
}

struct Scratch {
  std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("tellurion_output_errors_{}", getpid());
  Scratch() { std::filesystem::create_directories(folder); }
  ~Scratch() { std::filesystem::remove_all(folder); }
};

prepare::IngestOptions options_for(const std::string& input, const std::filesystem::path& out) {
  prepare::IngestOptions options;
  options.inputs = {input};
  options.out = out;
  options.error_table = true;
  options.workers = 2;
  options.memory_bytes = std::size_t{256} << 20;
  return options;
}

std::shared_ptr<const source::RasterSource> open(const std::filesystem::path& file) {
  source::GdalOptions how;
  how.path = file.string();
  auto source = source::open_gdal(how, geo::kWgs84);
  REQUIRE(source);
  return std::move(*source);
}

/// As the program makes it when the raster is shown.
ErrorTable scanned(const std::shared_ptr<const source::RasterSource>& raster) {
  auto description = std::make_shared<surface::SurfaceDescription>();
  description->ellipsoid = geo::kWgs84;
  surface::Layer layer;
  layer.source = raster;
  description->heights = {layer};
  cache::BlockCache blocks(std::size_t{64} << 20);
  auto model = surface::ElevationModel::open(description, blocks);
  REQUIRE(model);
  std::vector<surface::SubtreeScan> scans;
  for (const geo::TileKey& job : surface::scan_jobs()) {
    auto scan = surface::scan_subtree(*model, job);
    REQUIRE(scan);
    scans.push_back(std::move(*scan));
  }
  return surface::merge_scans(scans);
}

int compare(const ErrorTable& table, const ErrorTable& other, const geo::TileKey& key) {
  const auto one = table.find(key), two = other.find(key);
  CHECK(one.own == two.own);
  CHECK(one.record == two.record);
  if (!one.own || !two.own) return 0;
  int tiles = 1;
  for (int i = 0; i < 4; ++i) tiles += compare(table, other, geo::child(key, i));
  return tiles;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

TEST_CASE("make_error_table: the table beside the output is that which the program makes of it when it is shown") {
  const Scratch scratch;
  const test::MadeFile input("errors_input.tif", rough_ground(700, 600));
  const auto out = scratch.folder / "out.tif";
  const auto report = prepare::ingest(options_for(input.path(), out), {});
  REQUIRE(report);
  CHECK(report->measured);
  const auto raster = open(out);
  const auto prepared = surface::load_prepared_table(*raster, geo::kWgs84);
  REQUIRE(prepared);
  const ErrorTable expected = scanned(raster);
  CHECK(prepared->tile_count() == expected.tile_count());
  int tiles = 0;
  for (std::uint8_t face = 0; face < 6; ++face) tiles += compare(*prepared, expected, {face, 0, 0, 0});
  CHECK(static_cast<std::size_t>(tiles) == prepared->tile_count());
  // Beside the hole the ground is whole, at the hole and past the border it is not.
  const auto whole_at = [&](double latitude, double longitude) {
    const geo::LatLon place{to_radians(Degrees(latitude)), to_radians(Degrees(longitude))};
    return prepared->find(geo::tile_at(geo::normal_at(place), 12)).record.whole != 0;
  };
  CHECK(whole_at(47.0, 13.5));
  CHECK_FALSE(whole_at(49.6, 12.1));
  CHECK_FALSE(whole_at(50.5, 11.0));
}

TEST_CASE("make_error_table: the same bytes wherever and whenever; not made twice; a table of other data is none") {
  const Scratch scratch;
  const test::MadeFile input("errors_same.tif", rough_ground());
  std::filesystem::create_directories(scratch.folder / "elsewhere");
  const auto one = scratch.folder / "one.tif", other = scratch.folder / "elsewhere" / "other.tif";
  auto options = options_for(input.path(), one);
  REQUIRE(prepare::ingest(options, {}));
  const auto table = surface::prepared_table_file(one), others = surface::prepared_table_file(other);
  options.out = other;
  options.workers = 1;
  int all_parts = 0;
  REQUIRE(prepare::ingest(options, [&](const prepare::IngestProgress& progress) { return !progress.measures || ++all_parts > 0; }));
  CHECK(all_parts > static_cast<int>(surface::scan_jobs().size()));  // a job is made in parts
  CHECK(bytes_of(table) == bytes_of(others));
  CHECK(bytes_of(table).size() > 1000);

  auto again = prepare::ingest(options, {});
  REQUIRE(again);
  CHECK_FALSE(again->measured);
  std::filesystem::remove(others);
  int made_again = 0;
  again = prepare::ingest(options, [&](const prepare::IngestProgress&) { return ++made_again > 0; });
  REQUIRE(again);
  CHECK(again->measured);
  CHECK_FALSE(again->joined);
  CHECK(made_again == 0);  // all parts were kept
  CHECK(bytes_of(table) == bytes_of(others));

  // Interrupted after its first part it goes on, and ends the same.
  std::filesystem::remove_all(prepare::work_folder(other));
  std::filesystem::remove(others);
  int parts = 0;
  const auto stopped = prepare::ingest(options, [&](const prepare::IngestProgress& progress) { return !progress.measures || ++parts < 40; });
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().code == ErrorCode::cancelled);
  CHECK_FALSE(std::filesystem::exists(others));
  int left = 0;
  REQUIRE(prepare::ingest(options, [&](const prepare::IngestProgress& progress) { return !progress.measures || ++left > 0; }));
  CHECK(left == all_parts - 40);
  CHECK(bytes_of(table) == bytes_of(others));

  // Other heights under the same name.
  auto changed = rough_ground();
  changed.values[0][0] += 1;
  const test::MadeFile second("errors_changed.tif", changed);
  auto plain = options_for(second.path(), other);
  plain.error_table = std::nullopt;
  const std::string before = bytes_of(others);
  REQUIRE(prepare::ingest(plain, {}));
  CHECK_FALSE(std::filesystem::exists(others));  // few samples: no table, and the old one has gone
  std::ofstream(others, std::ios::binary) << before;
  const auto refused = surface::load_prepared_table(*open(other), geo::kWgs84);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::corrupt);
  CHECK(refused.error().message.find(others.string()) != std::string::npos);
  CHECK(refused.error().message.find("--error-table") != std::string::npos);
  // Read otherwise, or on another body.
  CHECK(surface::load_prepared_table(*open(one), geo::kWgs84));
  CHECK_FALSE(surface::load_prepared_table(*open(one), geo::kMars));
  source::GdalOptions how;
  how.path = one.string();
  how.scale = 2.0;
  const auto scaled = source::open_gdal(how, geo::kWgs84);
  REQUIRE(scaled);
  CHECK_FALSE(surface::load_prepared_table(**scaled, geo::kWgs84));
}

TEST_CASE("make_error_table: pictures have none, and asking for one is an error") {
  const Scratch scratch;
  test::MadeRaster picture;
  picture.width = picture.height = 300;
  picture.type = GDT_Byte;
  picture.transform = {{10, 0.01, 0, 50, 0, -0.01}};
  picture.values.assign(3, std::vector<double>(90000, 200.0));
  const test::MadeFile input("errors_picture.tif", picture);
  auto options = options_for(input.path(), scratch.folder / "picture.tif");
  const auto asked = prepare::ingest(options, {});
  REQUIRE_FALSE(asked);
  CHECK(asked.error().code == ErrorCode::invalid_argument);
  CHECK(asked.error().message.find("picture") != std::string::npos);
  options.error_table = std::nullopt;
  CHECK(prepare::ingest(options, {}));
  CHECK_FALSE(std::filesystem::exists(scratch.folder / "picture.tif.errors"));
}
