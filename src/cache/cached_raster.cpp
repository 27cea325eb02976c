#include "cache/cached_raster.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <utility>

namespace tellurion::cache {
namespace {

/// Blocks that a raster keeps hold of beside the cache: two megabytes of heights.
constexpr std::size_t kHeldBlocks = 8;

constexpr double kFarthestPixel = 1e9;  ///< what lies farther away is a mistake; nearer ones fit into an int

/// 1 inside [0, size], falling to 0 across one pixel on either side.
double ramp(double x, double size) { return std::clamp(1.0 + std::min(x, size - x), 0.0, 1.0); }

int wrapped(int i, int size) {
  const int m = i % size;
  return m < 0 ? m + size : m;
}

/// Column or row of the sample that stands for `i`: itself, the one round the body, or the outermost one.
int real_index(int i, int size, bool wraps) { return wraps ? wrapped(i, size) : std::clamp(i, 0, size - 1); }

/// The mean of the valid samples (upper left, upper right, lower left, lower right) by their bilinear weights.
HeightSample interpolate(const std::array<float, 4>& samples, double tx, double ty, double reach) {
  const std::array<double, 4> weights{(1 - tx) * (1 - ty), tx * (1 - ty), (1 - tx) * ty, tx * ty};
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * static_cast<double>(samples[i]);
  if (!std::isnan(sum)) return {sum, reach};
  sum = 0.0;
  double valid = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (std::isnan(samples[i])) continue;
    sum += weights[i] * static_cast<double>(samples[i]);
    valid += weights[i];
  }
  return valid > 0.0 ? HeightSample{sum / valid, valid * reach} : HeightSample{};
}

}  // namespace

Result<CachedRaster> CachedRaster::open(const source::RasterSource& source, BlockCache& cache, std::uint32_t id, std::uint32_t content) {
  Result<std::unique_ptr<source::RasterReader>> reader = source.open_reader();
  if (!reader) return reader.error();
  CachedRaster raster;
  raster.source_ = &source;
  raster.reader_ = std::move(reader).value();
  raster.cache_ = &cache;
  raster.id_ = id;
  raster.content_ = content;
  raster.held_.reserve(kHeldBlocks);
  return raster;
}

bool CachedRaster::take_pending(source::Awaited& awaited) {
  if (!std::exchange(pending_, false)) return false;
  absent_.clear();
  for (auto& arrival : reader_->take_awaited()) awaited.push_back(std::move(arrival));
  return true;
}

Result<Frozen<raster::HeightGrid>> CachedRaster::resident(const BlockKey& key) const {
  if (auto block = cache_->resident_heights(key)) return block;
  return Error{ErrorCode::pending, description().name};
}

Result<const raster::HeightGrid*> CachedRaster::height_block(int level, int column, int row) {
  const BlockKey key{id_, static_cast<std::uint32_t>(level), column, row, content_};
  const auto found = std::find_if(held_.begin(), held_.end(), [&](const Held& held) { return held.key == key; });
  if (found != held_.end()) {
    std::rotate(held_.begin(), found, std::next(found));  // the most recently used first
    return held_.front().block.get();
  }
  const auto decode = [&]() -> Result<raster::HeightGrid> {
    const source::LevelSize& size = description().levels[static_cast<std::size_t>(level)];
    const int x = column * kBlockSide;
    const int y = row * kBlockSide;
    return reader_->read_heights(level, {x, y, std::min(kBlockSide, size.width - x), std::min(kBlockSide, size.height - y)});
  };
  for (const Held& absent : absent_) {
    if (absent.key == key) return absent.block.get();
  }
  Result<Frozen<raster::HeightGrid>> block = reads_ ? cache_->heights(key, std::cref(decode)) : resident(key);
  if (!block && block.error().code == ErrorCode::pending) {
    static const Frozen<raster::HeightGrid> zeros =
        freeze(raster::HeightGrid{kBlockSide, kBlockSide, std::vector<float>(static_cast<std::size_t>(kBlockSide) * kBlockSide, 0.0f)});
    pending_ = true;
    absent_.push_back(Held{key, zeros});
    return absent_.back().block.get();
  }
  if (!block) return block.error();
  if (held_.size() == kHeldBlocks) held_.pop_back();
  held_.insert(held_.begin(), Held{key, std::move(block).value()});
  return held_.front().block.get();
}

Result<void> CachedRaster::sample_heights(int level, std::span<const glm::dvec2> pixels, std::span<HeightSample> heights) {
  assert(pixels.size() == heights.size());
  const glm::dvec2 scale = source::level_scale(description(), level);
  BlockView view;
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const glm::dvec2 pixel = pixels[n] * scale;
    const glm::dvec2 inner = pixel - view.first_centre;
    if (inner.x >= 0.0 && inner.x < view.last_cell.x && inner.y >= 0.0 && inner.y < view.last_cell.y) {  // false for NaN
      const int x = static_cast<int>(inner.x);
      const int y = static_cast<int>(inner.y);
      const float* upper = view.samples + (static_cast<std::ptrdiff_t>(y) * view.width + x);
      const float* lower = upper + view.width;
      heights[n] = interpolate({upper[0], upper[1], lower[0], lower[1]}, inner.x - x, inner.y - y, 1.0);
      continue;
    }
    Result<HeightSample> height = sample_anywhere(level, pixel, view);
    if (!height) return height.error();
    heights[n] = height.value();
  }
  return {};
}

/// Where samples come from several blocks, or from none. `view` becomes the block of the last sample.
Result<HeightSample> CachedRaster::sample_anywhere(int level, glm::dvec2 pixel, BlockView& view) {
  const source::LevelSize size = description().levels[static_cast<std::size_t>(level)];
  const bool wraps = description().wraps;
  const double reach = ramp(pixel.y, size.height) * (wraps ? 1.0 : ramp(pixel.x, size.width));
  if (!(reach > 0.0) || !(std::abs(pixel.x) < kFarthestPixel)) return HeightSample{};

  const glm::dvec2 corner = glm::floor(pixel - 0.5);
  const glm::dvec2 t = pixel - 0.5 - corner;
  std::array<float, 4> samples;
  for (int i = 0; i < 4; ++i) {
    const int x = real_index(static_cast<int>(corner.x) + (i & 1), size.width, wraps);
    const int y = real_index(static_cast<int>(corner.y) + (i >> 1), size.height, false);
    const int column = x / kBlockSide;
    const int row = y / kBlockSide;
    if (view.samples == nullptr || view.column != column || view.row != row) {
      Result<const raster::HeightGrid*> block = height_block(level, column, row);
      if (!block) return block.error();
      view = BlockView{block.value()->metres.data(), block.value()->width, column, row,
                       glm::dvec2(column, row) * static_cast<double>(kBlockSide) + 0.5,
                       glm::dvec2(block.value()->width - 1, block.value()->height - 1)};
    }
    samples[static_cast<std::size_t>(i)] = view.samples[(y - row * kBlockSide) * view.width + (x - column * kBlockSide)];
  }
  return interpolate(samples, t.x, t.y, reach);
}

Result<HeightSample> CachedRaster::nearest_height(glm::dvec2 pixel) {
  const source::LevelSize size = description().levels.front();
  const bool wraps = description().wraps;
  const glm::dvec2 cell = glm::floor(pixel);
  const bool inside = cell.y >= 0.0 && cell.y < size.height && std::abs(cell.x) < kFarthestPixel &&
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
  std::map<int, Frozen<raster::Image>> row_blocks;
  int row_of_blocks = -1;
  bool pending = false;
  for (int j = 0; j < window.height; ++j) {
    const int y = real_index(window.y + j, size.height, false);
    const int row = y / kBlockSide;
    if (row != row_of_blocks) {
      row_blocks.clear();
      row_of_blocks = row;
    }
    for (int i = 0; i < window.width;) {
      const int x = real_index(window.x + i, size.width, wraps);
      const int column = x / kBlockSide;
      Frozen<raster::Image>& block = row_blocks[column];
      if (!block) {
        const int left = column * kBlockSide;
        const int top = row * kBlockSide;
        const auto decode = [&] {
          return reader_->read_colours(
              level, {left, top, std::min(kBlockSide, size.width - left), std::min(kBlockSide, size.height - top)});
        };
        const BlockKey key{id_, static_cast<std::uint32_t>(level), column, row, content_};
        Result<Frozen<raster::Image>> decoded = cache_->image(key, std::cref(decode), description().is_remote ? Remaking::cheap : Remaking::dear);  // a server's replies are kept on the disk
        if (decoded) {
          block = std::move(decoded).value();
        } else if (decoded.error().code == ErrorCode::pending) {
          pending = true;  // the others are asked for too
          block = freeze(raster::Image{std::min(kBlockSide, size.width - left), std::min(kBlockSide, size.height - top), {}});
        } else {
          return decoded.error();
        }
      }
      const int inner_x = x - column * kBlockSide;
      const bool beyond = !wraps && (window.x + i < 0 || window.x + i >= size.width);
      const int run = beyond ? 1 : std::min(block->width - inner_x, window.width - i);
      if (!pending) {
        std::memcpy(&image.rgba[image.offset(i, j)], &block->rgba[block->offset(inner_x, y - row * kBlockSide)],
                    static_cast<std::size_t>(run) * 4);
      }
      i += run;
    }
  }
  if (pending) {
    pending_ = true;
    return Error{ErrorCode::pending, description().name};
  }
  return image;
}

}  // namespace tellurion::cache
