#include "raster/height_codes.h"

#include <cmath>

#include <doctest/doctest.h>

using namespace tellurion::raster;

namespace {

float decoded(HeightCode code, std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a = 255) {
  return decode_heights(Image{1, 1, {r, g, b, a}}, code).metres.front();
}

}  // namespace

// Expected values by hand from the formulas that the services publish.
TEST_CASE("decode_heights: known codes of known heights") {
  CHECK(decoded(HeightCode::terrarium, 128, 0, 0) == 0.0f);
  CHECK(decoded(HeightCode::terrarium, 162, 144, 128) == 8848.5f);
  CHECK(decoded(HeightCode::terrain_rgb, 1, 134, 160) == doctest::Approx(0.0));
  CHECK(decoded(HeightCode::terrain_rgb, 0, 0, 0) == -10000.0f);
  CHECK(std::isnan(decoded(HeightCode::terrarium, 128, 0, 0, 0)));
}

// c = round((h + 1000) * 100) * 16, by hand: 0 m is 100000 * 16 = 0x186a00, 8848.86 m 984886 * 16 = 0xf07360.
TEST_CASE("decode_heights: the 24-bit centimetre code") {
  CHECK(decoded(HeightCode::centimetres, 0, 0, 0) == -1000.0f);
  CHECK(decoded(HeightCode::centimetres, 0x18, 0x6a, 0x00) == 0.0f);
  CHECK(decoded(HeightCode::centimetres, 0x18, 0x6a, 0x10) == 0.01f);
  CHECK(decoded(HeightCode::centimetres, 0xf0, 0x73, 0x60) == 8848.86f);
  CHECK(decoded(HeightCode::centimetres, 0xff, 0xff, 0xf0) == 9485.75f);
  CHECK(std::isnan(decoded(HeightCode::centimetres, 0, 0, 0, 0)));
}

TEST_CASE("height_code: every code has a name, and other names have none") {
  for (const HeightCode code : {HeightCode::terrarium, HeightCode::terrain_rgb, HeightCode::centimetres}) CHECK(height_code(name_of(code)) == code);
  CHECK_FALSE(height_code("morse"));
}
