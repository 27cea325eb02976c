#include "source/gdal/jpeg_header.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <cpl_vsi.h>
#include <doctest/doctest.h>
#include <gdal_priv.h>

#include "source/made_raster.h"

using namespace tellurion::source;
using tellurion::test::MadeFile;

namespace {

std::vector<std::uint8_t> jpeg(bool progressive) {
  const MadeFile grey("grey.tif", {.width = 40, .height = 30, .values = {std::vector<double>(1200, 90.0)}, .type = GDT_Byte});
  const GDALDatasetUniquePtr from(GDALDataset::Open(grey.path().c_str()));
  REQUIRE(from);
  const char* options[] = {progressive ? "PROGRESSIVE=YES" : "PROGRESSIVE=NO", nullptr};
  const std::string name = "/vsimem/made.jpg";
  REQUIRE(GDALDatasetUniquePtr(GetGDALDriverManager()->GetDriverByName("JPEG")->CreateCopy(name.c_str(), from.get(), FALSE, const_cast<char**>(options), nullptr, nullptr)));
  vsi_l_offset size = 0;
  GByte* bytes = VSIGetMemFileBuffer(name.c_str(), &size, TRUE);
  std::vector<std::uint8_t> copy(bytes, bytes + size);
  VSIFree(bytes);
  return copy;
}

bool is_progressive(std::vector<std::uint8_t> bytes) {
  const std::string name = "/vsimem/header.jpg";
  VSIFCloseL(VSIFileFromMemBuffer(name.c_str(), bytes.data(), bytes.size(), FALSE));
  const bool found = is_progressive_jpeg(name);
  VSIUnlink(name.c_str());
  return found;
}

}  // namespace

TEST_CASE("is_progressive_jpeg: what GDAL wrote so, and nothing else") {
  CHECK(is_progressive(jpeg(true)));
  CHECK_FALSE(is_progressive(jpeg(false)));
  CHECK_FALSE(is_progressive_jpeg("/vsimem/not there.jpg"));
  CHECK_FALSE(is_progressive({}));
  CHECK_FALSE(is_progressive(std::vector<std::uint8_t>(1000, 0xff)));
}

TEST_CASE("is_progressive_jpeg: a file cut anywhere, with fill bytes, or with a segment longer than itself") {
  const std::vector<std::uint8_t> whole = jpeg(true);
  const auto header = std::ranges::search(whole, std::vector<std::uint8_t>{0xff, 0xc2}).begin() - whole.begin();
  for (std::ptrdiff_t length = 0; length < header + 2; ++length) CHECK_FALSE(is_progressive({whole.begin(), whole.begin() + length}));
  CHECK(is_progressive({whole.begin(), whole.begin() + header + 2}));
  std::vector<std::uint8_t> filled = whole;
  filled.insert(filled.begin() + header, 3, 0xff);
  CHECK(is_progressive(filled));
  std::vector<std::uint8_t> too_long = whole;
  too_long[4] = too_long[5] = 0xff;  // the first segment's length
  CHECK_FALSE(is_progressive(too_long));
}
