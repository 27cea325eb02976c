#include "prepare/chunk_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <doctest/doctest.h>
#include <unistd.h>

#include "prepare/plan.h"

using namespace tellurion;
using namespace tellurion::prepare;

namespace {

namespace fs = std::filesystem;

/// A folder of the test's own, removed at the end.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("tellurion-chunks-" + std::to_string(getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
};

std::vector<std::byte> bytes_of_length(std::size_t count) { return std::vector<std::byte>(count, std::byte{42}); }

void write_chunk(const fs::path& file) {
  auto writer = ChunkWriter::create(file);
  REQUIRE(writer);
  REQUIRE(writer->add(0, bytes_of_length(100)));
  REQUIRE(writer->add(0, {}));
  REQUIRE(writer->add(1, bytes_of_length(7)));
  REQUIRE(writer->finish({2, 2, bytes_of_length(4)}, {{1.0, 2.0, 3.0, 5.0, 2}}));
}

}  // namespace

TEST_CASE("ChunkWriter: what is written is read again") {
  const Folder folder;
  write_chunk(folder.path / "a.blocks");
  const auto index = read_chunk_index(folder.path / "a.blocks");
  REQUIRE(index);
  REQUIRE(index->levels.size() == 2);
  CHECK(index->levels[0][0].bytes == 100);
  CHECK(index->levels[0][1].bytes == 0);
  CHECK(index->levels[1][0].offset == 100);
  CHECK(index->seed.width == 2);
  CHECK(index->seed_place.bytes == 4);
  CHECK(index->bands[0].most == 2.0);
}

TEST_CASE("ChunkWriter: a chunk that is not finished leaves nothing") {
  const Folder folder;
  {
    auto writer = ChunkWriter::create(folder.path / "a.blocks");
    REQUIRE(writer);
    REQUIRE(writer->add(0, bytes_of_length(100)));
  }
  CHECK(fs::is_empty(folder.path));
}

TEST_CASE("read_chunk_index: a file that was cut off or changed is no chunk") {
  const Folder folder;
  const fs::path file = folder.path / "a.blocks";
  write_chunk(file);
  const auto size = fs::file_size(file);
  fs::resize_file(file, size - 1);
  CHECK(read_chunk_index(file).error().code == ErrorCode::corrupt);
  fs::resize_file(file, 3);
  CHECK(read_chunk_index(file).error().code == ErrorCode::corrupt);
  fs::remove(file);
  CHECK(read_chunk_index(file).error().code == ErrorCode::not_found);
  write_chunk(file);
  {
    std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(static_cast<std::streamoff>(size) - 40);
    stream.put('!');
  }
  CHECK(read_chunk_index(file).error().code == ErrorCode::corrupt);
}

TEST_CASE("plan_from_text: a plan is the same after it was text; damaged ones are errors") {
  OutputPlan plan;
  plan.crs = "LOCAL_CS[\"x\"]";
  plan.transform = {0.1, 1.0 / 3.0, 0.0, 5.0, 0.0, -1.0 / 3.0};
  plan.width = 5000;
  plan.height = 3000;
  plan.layout.no_data = std::nan("");
  plan.bands = {{"Gray", "", "m", 1.0, 0.0}};
  choose_chunks(plan, 0);
  CHECK(plan.chunk_columns() == 3);
  CHECK(plan.chunk_rows() == 2);
  CHECK(plan.last_chunk_level() == 2);
  CHECK(plan.level_count() == 5);
  plan.chunk_hashes.assign(6, "1234");
  const std::string text = to_text(plan);
  const auto again = plan_from_text(text);
  REQUIRE(again);
  CHECK(to_text(*again) == text);
  for (const std::string bad : {"", "{}", "[]", "{\"version\":1}"}) CHECK_FALSE(plan_from_text(bad).has_value());
  plan.chunk_hashes.pop_back();
  CHECK_FALSE(plan_from_text(to_text(plan)).has_value());
}
