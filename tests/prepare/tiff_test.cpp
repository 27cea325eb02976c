#include "prepare/tiff.h"

#include <cstring>
#include <string_view>

#include <doctest/doctest.h>

using namespace tellurion::prepare;

namespace {

CogLevel level_of(std::uint32_t side, std::vector<std::uint32_t> block_bytes) {
  CogLevel level;
  set_field(level.directory, long_field(257, side));
  set_field(level.directory, long_field(256, side));
  level.block_bytes = std::move(block_bytes);
  return level;
}

std::vector<std::uint64_t> offsets_of(const TiffDirectory& directory) { return numbers_of(*find_field(directory, kTileOffsetsTag)); }

}  // namespace

TEST_CASE("lay_out_cog: the coarsest level's blocks come first, each after its leader; blank ones are nowhere") {
  const CogHead head = lay_out_cog({level_of(1024, {10, 0, 30, 40}), level_of(512, {5})});
  const auto directory = read_directory(head.bytes);
  REQUIRE(directory);
  CHECK(numbers_of(*find_field(*directory, 256)) == std::vector<std::uint64_t>{1024});
  CHECK(numbers_of(*find_field(*directory, kTileByteCountsTag)) == std::vector<std::uint64_t>{10, 0, 30, 40});
  const std::uint64_t data = head.bytes.size() + 5 + kBlockFrameBytes + 4;
  CHECK(offsets_of(*directory) == std::vector<std::uint64_t>{data, 0, data + 10 + 8, data + 10 + 8 + 30 + 8});
  CHECK(head.file_bytes == head.bytes.size() + 5 + 10 + 30 + 40 + 4 * kBlockFrameBytes);
  CHECK(std::string_view(reinterpret_cast<const char*>(head.bytes.data()) + 8, 29) == "GDAL_STRUCTURAL_METADATA_SIZE");
}

TEST_CASE("lay_out_cog: files past 4 GB are BigTIFF") {
  const CogHead head = lay_out_cog({level_of(1024, {0xf0000000, 0xf0000000, 1, 1}), level_of(512, {5})});
  CHECK(std::to_integer<int>(head.bytes[2]) == 43);
  CHECK(head.file_bytes == head.bytes.size() + 2 * std::uint64_t{0xf0000000} + 7 + 5 * kBlockFrameBytes);
}

TEST_CASE("read_directory: bytes that are cut off or point outside are errors") {
  const CogHead head = lay_out_cog({level_of(1024, {10, 0, 30, 40})});
  for (std::size_t length = 0; length < head.bytes.size(); ++length) {
    const auto directory = read_directory(std::span(head.bytes).first(length));
    if (directory) CHECK(directory->size() == 4);
  }
  auto bytes = head.bytes;
  for (std::size_t at = 4; at < bytes.size(); ++at) {
    const std::byte kept = bytes[at];
    bytes[at] = std::byte{0xff};
    (void)read_directory(bytes).has_value();
    bytes[at] = kept;
  }
}
