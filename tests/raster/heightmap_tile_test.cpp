#include "raster/heightmap_tile.h"

#include <cmath>
#include <functional>
#include <string>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::raster;

namespace {

/// A tile with a number of fifths of a metre over -1000 m at each of its samples; row 0 north.
std::string made_tile(const std::function<int(int column, int row)>& fifths) {
  std::string bytes;
  for (int row = 0; row < 65; ++row) {
    for (int column = 0; column < 65; ++column) {
      const int number = fifths(column, row);
      bytes.push_back(static_cast<char>(number & 255));
      bytes.push_back(static_cast<char>(number >> 8));
    }
  }
  return bytes;
}

const std::string kMasks("\x0f\0", 2);

}  // namespace

TEST_CASE("decode_heightmap_tile: a number is fifths of a metre above -1000 m, up to those that need 16 bits") {
  // 5000 fifths are sea level, 49243 Everest's 8848.6 m.
  const auto sea = decode_heightmap_tile(made_tile([](int, int) { return 5000; }) + kMasks, 3, 2);
  REQUIRE(sea);
  CHECK(sea->width == 3);
  CHECK(sea->height == 2);
  for (const float metres : sea->metres) CHECK(metres == 0.0f);
  const auto peak = decode_heightmap_tile(made_tile([](int, int) { return 49243; }) + kMasks, 1, 1);
  REQUIRE(peak);
  CHECK(peak->at(0, 0) == doctest::Approx(8848.6));
  const auto pit = decode_heightmap_tile(made_tile([](int, int) { return 0; }) + kMasks, 1, 1);
  REQUIRE(pit);
  CHECK(pit->at(0, 0) == -1000.0f);
}

TEST_CASE("decode_heightmap_tile: the outermost samples lie on the tile's edges, between samples it is bilinear") {
  // Height = 100 m a column + 1 m a row - 1000 m: the centre of pixel (i, j) of 32 lies at column 2 i + 1, row 2 j + 1.
  const auto even = decode_heightmap_tile(made_tile([](int column, int row) { return 500 * column + 5 * row; }) + kMasks, 32, 32);
  REQUIRE(even);
  for (int j = 0; j < 32; ++j) {
    for (int i = 0; i < 32; ++i) CHECK(even->at(i, j) == doctest::Approx(100.0 * (2 * i + 1) + (2 * j + 1) - 1000.0));
  }
  // 128 pixels: centres at a quarter and three quarters between samples, the first one a quarter from the edge.
  const auto fine = decode_heightmap_tile(made_tile([](int column, int row) { return 500 * column + 5 * row; }) + kMasks, 128, 128);
  REQUIRE(fine);
  CHECK(fine->at(0, 0) == doctest::Approx(25.0 + 0.25 - 1000.0));
  CHECK(fine->at(127, 127) == doctest::Approx(100.0 * 63.75 + 63.75 - 1000.0));
  // One sample stands out by 100 m: a quarter of a step away in both directions it counts for 9/16.
  const auto peak = decode_heightmap_tile(made_tile([](int column, int row) { return column == 10 && row == 20 ? 5500 : 5000; }) + kMasks, 128, 128);
  REQUIRE(peak);
  CHECK(peak->at(20, 40) == doctest::Approx(56.25));
  CHECK(peak->at(19, 39) == doctest::Approx(56.25));
  CHECK(peak->at(21, 40) == doctest::Approx(18.75));
  CHECK(peak->at(22, 40) == 0.0f);
}

TEST_CASE("decode_heightmap_tile: masks may lack or be of either size, anything else is corrupt") {
  const std::string heights = made_tile([](int, int) { return 5000; });
  for (const std::size_t masks : {0u, 1u, 2u, 65537u}) CHECK(decode_heightmap_tile(heights + std::string(masks, '\0'), 4, 4));
  for (const std::string& wrong : {std::string(), heights.substr(1), heights + "abc", heights + std::string(65538, '\0'), std::string("\x1f\x8b\x08", 3)}) {
    const auto tile = decode_heightmap_tile(wrong, 4, 4);
    REQUIRE_FALSE(tile);
    CHECK(tile.error().code == ErrorCode::corrupt);
    CHECK_FALSE(tile.error().message.empty());
  }
}

TEST_CASE("decode_heightmap_tile: a tile whose heights begin as gzip does is read as it is") {
  // 0x8b1f fifths, then 0x0008.
  const auto tile = decode_heightmap_tile(made_tile([](int column, int row) { return column + row == 0 ? 0x8b1f : 0x0008; }) + kMasks, 64, 64);
  REQUIRE(tile);
  CHECK(tile->at(63, 63) == doctest::Approx(8 / 5.0 - 1000.0));
}

// 4225 times the number 5000 and two bytes of masks, written by Python's struct and packed by gzip -n -9.
TEST_CASE("decode_heightmap_tile: reads gzipped tiles") {
  const std::string zipped(
      "\x1f\x8b\x08\x00\x00\x00\x00\x00\x02\x03\xed\xc2\x31\x0d\x00\x00\x08\x03\x30\x1c\x70\x60\x7a\xb2\xa7\x83\xa4\x69\x73\x01"
      "\x00\x00\x00\x00\x00\x00\x00\x78\x6e\xa7\xf8\x12\x71\x1d\x04\x21\x00\x00",
      48);
  const auto tile = decode_heightmap_tile(zipped, 5, 5);
  REQUIRE(tile);
  for (const float metres : tile->metres) CHECK(metres == 0.0f);
}
