// A rectangle of heights.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace tellurion::raster {

inline constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();

/// Row-major heights in metres, row 0 north (lowest pixel row); NaN where there is no data.
/// Sample (i, j) belongs to pixel coordinates (i + 0.5, j + 0.5) of its raster's level.
struct HeightGrid {
  int width = 0;
  int height = 0;
  std::vector<float> metres;

  float at(int x, int y) const { return metres[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
  float& at(int x, int y) { return metres[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
  std::size_t bytes() const { return metres.size() * sizeof(float); }
};

}  // namespace tellurion::raster
