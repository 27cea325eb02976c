#include "source/gdal/picture_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <cpl_error.h>
#include <cpl_vsi.h>
#include <doctest/doctest.h>
#include <gdal_priv.h>

using namespace tellurion;
using namespace tellurion::source;

namespace {

constexpr int kSide = 32;

/// The bytes of a file that GDAL writes of a picture of three channels.
std::string written(const char* format, const std::vector<const char*>& options = {}) {
  GDALAllRegister();
  GDALDatasetUniquePtr picture(GetGDALDriverManager()->GetDriverByName("MEM")->Create("", kSide, kSide, 3, GDT_Byte, nullptr));
  for (int channel = 0; channel < 3; ++channel) {
    std::array<unsigned char, kSide * kSide> samples{};
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<unsigned char>(i * (7 + static_cast<std::size_t>(channel) * 6));
    REQUIRE(picture->GetRasterBand(channel + 1)->RasterIO(GF_Write, 0, 0, kSide, kSide, samples.data(), kSide, kSide, GDT_Byte, 0, 0, nullptr) == CE_None);
  }
  std::vector<const char*> list = options;
  list.push_back(nullptr);
  const char* path = "/vsimem/picture_file_test";
  CPLPushErrorHandler(CPLQuietErrorHandler);
  GDALClose(GetGDALDriverManager()->GetDriverByName(format)->CreateCopy(path, picture.get(), FALSE, const_cast<char**>(list.data()), nullptr, nullptr));
  CPLPopErrorHandler();
  vsi_l_offset size = 0;
  GByte* bytes = VSIGetMemFileBuffer(path, &size, FALSE);
  REQUIRE(bytes != nullptr);
  std::string result(reinterpret_cast<const char*>(bytes), size);
  VSIUnlink(path);
  VSIUnlink((std::string(path) + ".aux.xml").c_str());
  return result;
}

}  // namespace

TEST_CASE("decode_exact_picture: lossless formats give the very pixels that were written") {
  for (const std::string& bytes : {written("PNG"), written("WEBP", {"LOSSLESS=YES"}), written("GTiff"), written("GTiff", {"COMPRESS=DEFLATE"}),
                                   written("GTiff", {"COMPRESS=WEBP", "WEBP_LOSSLESS=YES"})}) {
    const auto picture = decode_exact_picture(bytes, kSide);
    REQUIRE(picture);
    CHECK(picture->at(5, 3) == std::array<std::uint8_t, 4>{static_cast<std::uint8_t>(101 * 7), static_cast<std::uint8_t>(101 * 13), static_cast<std::uint8_t>(101 * 19), 255});
  }
}

TEST_CASE("decode_exact_picture: what was compressed with loss is refused, and decode_picture reads it") {
  for (const std::string& bytes : {written("JPEG"), written("JPEG", {"QUALITY=100"}), written("WEBP"), written("GTiff", {"COMPRESS=JPEG"}),
                                   written("GTiff", {"COMPRESS=JPEG", "PHOTOMETRIC=YCBCR"}), written("GTiff", {"COMPRESS=WEBP"})}) {
    const auto exact = decode_exact_picture(bytes, kSide);
    REQUIRE_FALSE(exact);
    CHECK(exact.error().code == ErrorCode::unsupported);
    CHECK(exact.error().message.find("lossless") != std::string::npos);
    CHECK(decode_picture(bytes, kSide));
  }
}

TEST_CASE("decode_exact_picture: what is no picture is corrupt, what is too large is not read") {
  for (const std::string& bytes : {std::string(), std::string("no picture"), written("PNG").substr(0, 20)}) {
    const auto picture = decode_exact_picture(bytes, kSide);
    REQUIRE_FALSE(picture);
    CHECK(picture.error().code == ErrorCode::corrupt);
  }
  const auto large = decode_exact_picture(written("PNG"), kSide - 1);
  REQUIRE_FALSE(large);
  CHECK(large.error().code == ErrorCode::exhausted);
}

TEST_CASE("decode_height_band: 16-bit numbers that name no value for voids have the usual ones") {
  GDALAllRegister();
  for (const std::optional<double> no_data : {std::optional<double>(), std::optional(-9999.0)}) {
    const char* path = "/vsimem/picture_file_test.tif";
    {
      const GDALDatasetUniquePtr file(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(path, 5, 1, 1, GDT_Int16, nullptr));
      if (no_data) file->GetRasterBand(1)->SetNoDataValue(*no_data);
      std::array<std::int16_t, 5> samples{-32768, -32767, -32766, -9999, 7};
      REQUIRE(file->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 5, 1, samples.data(), 5, 1, GDT_Int16, 0, 0, nullptr) == CE_None);
    }
    vsi_l_offset size = 0;
    const GByte* data = VSIGetMemFileBuffer(path, &size, FALSE);
    const std::string bytes(reinterpret_cast<const char*>(data), size);
    VSIUnlink(path);
    const auto grid = decode_height_band(bytes, kSide);
    REQUIRE(grid);
    CHECK(std::isnan(grid->at(0, 0)) == !no_data);
    CHECK(std::isnan(grid->at(1, 0)) == !no_data);
    CHECK(grid->at(2, 0) == -32766.0f);
    CHECK(std::isnan(grid->at(3, 0)) == no_data.has_value());
    CHECK(grid->at(4, 0) == 7.0f);
  }
}
