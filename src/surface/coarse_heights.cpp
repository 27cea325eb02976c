#include "surface/coarse_heights.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <glm/common.hpp>

namespace tellurion::surface {

raster::HeightGrid halved(const raster::HeightGrid& fine) {
  raster::HeightGrid coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
  coarse.metres.reserve(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height));
  for (int y = 0; y < coarse.height; ++y) {
    for (int x = 0; x < coarse.width; ++x) {
      float sum = 0.0f;
      int valid = 0;
      for (int row = 2 * y; row < std::min(2 * y + 2, fine.height); ++row) {
        for (int column = 2 * x; column < std::min(2 * x + 2, fine.width); ++column) {
          const float metres = fine.at(column, row);
          if (std::isnan(metres)) continue;
          sum += metres;
          ++valid;
        }
      }
      coarse.metres.push_back(valid > 0 ? sum / static_cast<float>(valid) : raster::kNoHeight);
    }
  }
  return coarse;
}

cache::HeightSample CoarseHeights::sample(glm::dvec2 pixel) const {
  const glm::dvec2 at = pixel * scale - 0.5;
  const glm::dvec2 corner = glm::floor(at);
  const glm::dvec2 share = at - corner;
  double sum = 0.0, valid = 0.0;
  for (int i = 0; i < 4; ++i) {
    const int x = std::clamp(static_cast<int>(corner.x) + (i & 1), 0, grid.width - 1);
    const int y = std::clamp(static_cast<int>(corner.y) + (i >> 1), 0, grid.height - 1);
    const float metres = grid.at(x, y);
    if (std::isnan(metres)) continue;
    const double weight = ((i & 1) != 0 ? share.x : 1.0 - share.x) * ((i >> 1) != 0 ? share.y : 1.0 - share.y);
    sum += weight * static_cast<double>(metres);
    valid += weight;
  }
  return valid > 0.0 ? cache::HeightSample{sum / valid, valid} : cache::HeightSample{};
}

Result<CoarseHeights> last_level(cache::CachedRaster& raster) {
  const source::RasterDescription& about = raster.description();
  const int level = static_cast<int>(about.levels.size()) - 1;
  const source::LevelSize size = about.levels.back();
  CoarseHeights last;
  last.scale = source::level_scale(about, level);
  std::vector<glm::dvec2> pixels;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) pixels.push_back((glm::dvec2(x, y) + 0.5) / last.scale);
  }
  std::vector<cache::HeightSample> samples(pixels.size());
  if (Result<void> read = raster.sample_heights(level, pixels, samples); !read) return read.error();
  last.grid = {size.width, size.height, {}};
  for (const cache::HeightSample& sample : samples) {
    // At a sample's own place, its coverage is 1 or, but for rounding, 0.
    last.grid.metres.push_back(sample.coverage > 0.5 ? static_cast<float>(sample.metres) : raster::kNoHeight);
  }
  return last;
}

CoarseHeights next_level(const CoarseHeights& fine) { return {halved(fine.grid), fine.scale / 2.0}; }

}  // namespace tellurion::surface
