// A rectangle of colours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tellurion::raster {

/// Row-major RGBA, 8 bits a channel as encoded (sRGB), premultiplied by alpha; row 0 north. No data is (0, 0, 0, 0).
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;

  std::size_t offset(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4;
  }
  std::array<std::uint8_t, 4> at(int x, int y) const {
    const std::size_t o = offset(x, y);
    return {rgba[o], rgba[o + 1], rgba[o + 2], rgba[o + 3]};
  }
  std::size_t bytes() const { return rgba.size(); }
};

}  // namespace tellurion::raster
