#include "cache/cached_raster.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <utility>

namespace tellurion::cache {
namespace {

/// Blocks that a raster keeps hold of beside the cache: two megabytes of heights.
constexpr std::size_t kHeldBlocks = 8;

/// 1 inside [0, size], falling to 0 across one pixel on either side.
double ramp(double x, double size) { return std::clamp(1.0 + std::min(x, size - x), 0.0, 1.0); }

int wrapped(int i, int size) {
  const int m = i % size;
  return m < 0 ? m + size : m;
}

/// Column or row of the sample that stands for `i`: itself, the one round the body, or the outermost one.
int real_index(int i, int size, bool wraps) { return wraps ? wrapped(i, size) : std::clamp(i, 0, size - 1); }

}  // namespace

Result<CachedRaster> CachedRaster::open(const source::RasterSource& source, BlockCache& cache, std::uint32_t id) {
  Result<std::unique_ptr<source::RasterReader>> reader = source.open_reader();
  if (!reader) return reader.error();
  CachedRaster raster;
  raster.source_ = &source;
  raster.reader_ = std::move(reader).value();
  raster.cache_ = &cache;
  raster.id_ = id;
  raster.held_.reserve(kHeldBlocks);
  return raster;
}

Result<const raster::HeightGrid*> CachedRaster::height_block(int level, int column, int row) {
  const BlockKey key{id_, static_cast<std::uint32_t>(level), column, row};
  const auto found = std::find_if(held_.begin(), held_.end(), [&](const Held& held) { return held.key == key; });
  if (found != held_.end()) {
    if (found != held_.begin()) std::swap(*found, *std::prev(found));  // what is used often moves to the front
    return std::find_if(held_.begin(), held_.end(), [&](const Held& held) { return held.key == key; })->block.get();
  }
  const auto decode = [&]() -> Result<raster::HeightGrid> {
    const source::LevelSize& size = description().levels[static_cast<std::size_t>(level)];
    const int x = column * kBlockSide;
    const int y = row * kBlockSide;
    return reader_->read_heights(level, {x, y, std::min(kBlockSide, size.width - x), std::min(kBlockSide, size.height - y)});
  };
  Result<Frozen<raster::HeightGrid>> block = cache_->heights(key, std::cref(decode));
  if (!block) return block.error();
  if (held_.size() < kHeldBlocks) {
    held_.push_back({key, std::move(block).value()});
  } else {
    held_.back() = {key, std::move(block).value()};
  }
  return held_.back().block.get();
}

Result<void> CachedRaster::sample_heights(int level, std::span<const glm::dvec2> pixels, std::span<HeightSample> heights) {
  assert(pixels.size() == heights.size());
  const source::RasterDescription& about = description();
  const source::LevelSize size = about.levels[static_cast<std::size_t>(level)];
  const glm::dvec2 scale = source::level_scale(about, level);
  const raster::HeightGrid* block = nullptr;
  int block_column = -1;
  int block_row = -1;

  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const glm::dvec2 pixel = pixels[n] * scale;
    heights[n] = HeightSample{};
    double reach = ramp(pixel.y, size.height);
    if (!about.wraps) reach *= ramp(pixel.x, size.width);
    if (!(reach > 0.0) || !std::isfinite(pixel.x)) continue;

    const double left = std::floor(pixel.x - 0.5);
    const double top = std::floor(pixel.y - 0.5);
    const double tx = pixel.x - 0.5 - left;
    const double ty = pixel.y - 0.5 - top;
    const std::array<double, 4> weights{(1 - tx) * (1 - ty), tx * (1 - ty), (1 - tx) * ty, tx * ty};
    std::array<float, 4> samples;

    const int x = static_cast<int>(about.wraps ? left - std::floor(left / size.width) * size.width : left);
    const int y = static_cast<int>(top);
    const int column = x / kBlockSide;
    const int row = y / kBlockSide;
    const int inner_x = x - column * kBlockSide;
    const int inner_y = y - row * kBlockSide;
    const bool same = block != nullptr && column == block_column && row == block_row;
    if (same && inner_x >= 0 && inner_y >= 0 && inner_x + 1 < block->width && inner_y + 1 < block->height) {
      const float* upper = &block->metres[static_cast<std::size_t>(inner_y) * static_cast<std::size_t>(block->width) +
                                          static_cast<std::size_t>(inner_x)];
      samples = {upper[0], upper[1], upper[block->width], upper[block->width + 1]};
    } else {
      for (int corner = 0; corner < 4; ++corner) {
        const int sample_x = real_index(x + (corner & 1), size.width, about.wraps);
        const int sample_y = real_index(y + (corner >> 1), size.height, false);
        const int wanted_column = sample_x / kBlockSide;
        const int wanted_row = sample_y / kBlockSide;
        if (block == nullptr || wanted_column != block_column || wanted_row != block_row) {
          Result<const raster::HeightGrid*> next = height_block(level, wanted_column, wanted_row);
          if (!next) return next.error();
          block = next.value();
          block_column = wanted_column;
          block_row = wanted_row;
        }
        samples[static_cast<std::size_t>(corner)] =
            block->at(sample_x - wanted_column * kBlockSide, sample_y - wanted_row * kBlockSide);
      }
    }

    double sum = 0.0;
    double valid = 0.0;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      if (samples[corner] != samples[corner]) continue;
      sum += weights[corner] * static_cast<double>(samples[corner]);
      valid += weights[corner];
    }
    if (valid > 0.0) heights[n] = {sum / valid, valid * reach};
  }
  return {};
}

Result<HeightSample> CachedRaster::nearest_height(glm::dvec2 pixel) {
  const source::LevelSize size = description().levels.front();
  const bool wraps = description().wraps;
  const glm::dvec2 cell = glm::floor(pixel);
  const bool inside = cell.y >= 0.0 && cell.y < size.height && std::isfinite(cell.x) &&
                      (wraps || (cell.x >= 0.0 && cell.x < size.width));
  if (!inside) return HeightSample{};
  const int x = static_cast<int>(wraps ? cell.x - std::floor(cell.x / size.width) * size.width : cell.x);
  const int y = static_cast<int>(cell.y);
  Result<const raster::HeightGrid*> block = height_block(0, x / kBlockSide, y / kBlockSide);
  if (!block) return block.error();
  const float metres = block.value()->at(x % kBlockSide, y % kBlockSide);
  if (std::isnan(metres)) return HeightSample{};
  return HeightSample{static_cast<double>(metres), 1.0};
}

Result<raster::Image> CachedRaster::read_colours(int level, const source::PixelWindow& window) {
  const source::LevelSize size = description().levels[static_cast<std::size_t>(level)];
  const bool wraps = description().wraps;
  raster::Image image{window.width, window.height, {}};
  image.rgba.resize(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * 4);

  // Runs of pixels that come from one block, copied row by row.
  std::vector<Frozen<raster::Image>> row_blocks;
  int row_of_blocks = -1;
  for (int j = 0; j < window.height; ++j) {
    const int y = real_index(window.y + j, size.height, false);
    const int row = y / kBlockSide;
    if (row != row_of_blocks) {
      row_blocks.assign(static_cast<std::size_t>((size.width + kBlockSide - 1) / kBlockSide), {});
      row_of_blocks = row;
    }
    for (int i = 0; i < window.width;) {
      const int x = real_index(window.x + i, size.width, wraps);
      const int column = x / kBlockSide;
      Frozen<raster::Image>& block = row_blocks[static_cast<std::size_t>(column)];
      if (!block) {
        const int left = column * kBlockSide;
        const int top = row * kBlockSide;
        const auto decode = [&] {
          return reader_->read_colours(
              level, {left, top, std::min(kBlockSide, size.width - left), std::min(kBlockSide, size.height - top)});
        };
        const BlockKey key{id_, static_cast<std::uint32_t>(level), column, row};
        Result<Frozen<raster::Image>> decoded = cache_->image(key, std::cref(decode));
        if (!decoded) return decoded.error();
        block = std::move(decoded).value();
      }
      const int inner_x = x - column * kBlockSide;
      const bool beyond = !wraps && (window.x + i < 0 || window.x + i >= size.width);
      const int run = beyond ? 1 : std::min(block->width - inner_x, window.width - i);
      std::memcpy(&image.rgba[image.offset(i, j)], &block->rgba[block->offset(inner_x, y - row * kBlockSide)],
                  static_cast<std::size_t>(run) * 4);
      i += run;
    }
  }
  return image;
}

}  // namespace tellurion::cache
