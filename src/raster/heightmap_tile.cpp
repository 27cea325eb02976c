#include "raster/heightmap_tile.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <string>

#include <fmt/format.h>

#include "base/gzip.h"

namespace tellurion::raster {
namespace {

constexpr std::size_t kSide = 65;
constexpr std::size_t kHeightBytes = kSide * kSide * 2;
constexpr std::size_t kChildMaskBytes = 1;
constexpr std::size_t kSmallWaterMask = 1, kLargeWaterMask = 256 * 256;
constexpr std::size_t kMostBytes = kHeightBytes + kChildMaskBytes + kLargeWaterMask;
constexpr int kLargestSide = 4096;

/// Some writers leave out the masks.
bool has_right_size(std::string_view bytes) {
  if (bytes.size() < kHeightBytes) return false;
  const std::size_t masks = bytes.size() - kHeightBytes;
  return masks == 0 || masks == kChildMaskBytes || masks == kChildMaskBytes + kSmallWaterMask || masks == kChildMaskBytes + kLargeWaterMask;
}

/// Unsigned, as what reads and writes these tiles takes them, so that Everest fits.
double metres_at(std::string_view bytes, std::size_t column, std::size_t row) {
  const std::size_t at = 2 * (row * kSide + column);
  const int number = static_cast<unsigned char>(bytes[at]) | static_cast<unsigned char>(bytes[at + 1]) << 8;
  return number / 5.0 - 1000.0;
}

struct Between {
  std::size_t first;
  double share;  ///< of the next one
};

/// Where the centre of pixel `i` of `count` lies among the tile's own samples.
Between place(int i, int count) {
  const double at = (i + 0.5) / count * static_cast<double>(kSide - 1);
  const std::size_t first = std::min(static_cast<std::size_t>(at), kSide - 2);
  return {first, at - static_cast<double>(first)};
}

}  // namespace

Result<HeightGrid> decode_heightmap_tile(std::string_view bytes, int width, int height) {
  assert(width >= 1 && width <= kLargestSide && height >= 1 && height <= kLargestSide);
  std::string unpacked;
  if (!has_right_size(bytes) && is_gzip(bytes)) {
    Result<std::string> plain = gunzip(bytes, kMostBytes);
    if (!plain) return plain.error();
    unpacked = std::move(*plain);
    bytes = unpacked;
  }
  if (!has_right_size(bytes))
    return Error{ErrorCode::corrupt, fmt::format("is no heightmap of 65 x 65 heights: it has {} bytes, not {} and the masks' ones", bytes.size(), kHeightBytes)};
  HeightGrid grid{width, height, {}};
  grid.metres.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int j = 0; j < height; ++j) {
    const Between y = place(j, height);
    for (int i = 0; i < width; ++i) {
      const Between x = place(i, width);
      const double north = metres_at(bytes, x.first, y.first) * (1 - x.share) + metres_at(bytes, x.first + 1, y.first) * x.share;
      const double south = metres_at(bytes, x.first, y.first + 1) * (1 - x.share) + metres_at(bytes, x.first + 1, y.first + 1) * x.share;
      grid.metres.push_back(static_cast<float>(north * (1 - y.share) + south * y.share));
    }
  }
  return grid;
}

}  // namespace tellurion::raster
