#include "prepare/scan_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

using namespace tellurion;

TEST_CASE("save_scan, load_scan: the same scan comes back; what is damaged or of another tile is corrupt") {
  const geo::TileKey root{3, 2, 1, 3};
  surface::PartScan scan{root, surface::RecordTree(1), std::vector<surface::OpenRecord>(2)};
  const std::size_t children = scan.tree.add_children(0);
  scan.tree[children + 2].record = {-3.0f, 8.0f, {4.0f, 2.0f}, 1};
  scan.above[1].record = {-5.0f, 9.0f, {}, 0};
  scan.above[1].worst = 7.0;
  scan.above[1].tally.add(6.5);
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("tellurion_scan_{}", getpid());
  std::filesystem::create_directories(folder);
  const auto file = folder / "part.scan";
  CHECK(prepare::load_scan(file, root).error().code == ErrorCode::not_found);
  REQUIRE(prepare::save_scan(scan, file));
  const auto loaded = prepare::load_scan(file, root);
  REQUIRE(loaded);
  CHECK(loaded->tree.size() == 5);
  CHECK(loaded->tree[children + 2].record == scan.tree[children + 2].record);
  CHECK(loaded->above[1].record == scan.above[1].record);
  CHECK(loaded->above[1].worst == 7.0);
  CHECK(loaded->above[1].tally.common() == scan.above[1].tally.common());
  CHECK(prepare::load_scan(file, {3, 2, 1, 2}).error().code == ErrorCode::corrupt);
  CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 1);

  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = bytes;
    if (i % 2 == 0) damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    else damaged.resize(random() % damaged.size());
    std::ofstream(file, std::ios::binary) << damaged;
    CHECK(prepare::load_scan(file, root).error().code == ErrorCode::corrupt);
  }
  CHECK(prepare::save_scan(scan, folder / "none" / "part.scan").error().message.find("none") != std::string::npos);
  std::filesystem::remove_all(folder);
}
