#include "source/gdal/jpeg_header.h"

#include <array>
#include <cstdint>
#include <memory>

#include <cpl_vsi.h>

namespace tellurion::source {

// Markers and the lengths of their segments: ITU-T T.81, annex B.
bool is_progressive_jpeg(const std::string& path) {
  constexpr std::uint8_t kStartOfImage = 0xd8, kStartOfScan = 0xda, kEndOfImage = 0xd9;
  constexpr std::uint8_t kBaseline = 0xc0, kProgressive = 0xc2, kProgressiveArithmetic = 0xca;
  constexpr int kMostSegments = 10000;
  const std::unique_ptr<VSILFILE, int (*)(VSILFILE*)> file(VSIFOpenL(path.c_str(), "rb"), VSIFCloseL);
  std::array<std::uint8_t, 4> bytes{};
  const auto read = [&](std::size_t count) { return VSIFReadL(bytes.data(), 1, count, file.get()) == count; };
  if (!file || !read(2) || bytes[0] != 0xff || bytes[1] != kStartOfImage) return false;
  for (int i = 0; i < kMostSegments; ++i) {
    if (!read(2) || bytes[0] != 0xff) return false;
    while (bytes[1] == 0xff) {  // fill bytes
      std::uint8_t next = 0;
      if (VSIFReadL(&next, 1, 1, file.get()) != 1) return false;
      bytes[1] = next;
    }
    const std::uint8_t marker = bytes[1];
    if (marker == kProgressive || marker == kProgressiveArithmetic) return true;
    if (marker == kBaseline || marker == kStartOfScan || marker == kEndOfImage || !read(2)) return false;
    const int length = bytes[0] << 8 | bytes[1];
    if (length < 2 || VSIFSeekL(file.get(), static_cast<vsi_l_offset>(length - 2), SEEK_CUR) != 0) return false;
  }
  return false;
}

}  // namespace tellurion::source
