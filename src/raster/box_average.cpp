#include "raster/box_average.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

namespace tellurion::raster {
namespace {

/// Length of the fine cell [i, i + 1) within [low, high).
double overlap(int i, double low, double high) { return std::max(0.0, std::min(i + 1.0, high) - std::max<double>(i, low)); }

}  // namespace

BoxAverage::BoxAverage(const BoxLayout& layout) : layout_(layout) { assert(layout.step_x >= 1.0 && layout.step_y >= 1.0); }

template <int kChannels, class Sample>
void BoxAverage::add_samples(const Sample* samples, int strip_width, int strip_height, int first_column, int first_row) {
  const std::size_t cells = static_cast<std::size_t>(layout_.width) * static_cast<std::size_t>(layout_.height);
  sums_.resize(cells * kChannels);
  weights_.resize(cells);
  for (int j = 0; j < layout_.height; ++j) {
    const double top = layout_.y + j * layout_.step_y;
    const double bottom = top + layout_.step_y;
    const int row_end = std::min(static_cast<int>(std::ceil(bottom)), first_row + strip_height);
    for (int row = std::max(static_cast<int>(std::floor(top)), first_row); row < row_end; ++row) {
      const double row_weight = overlap(row, top, bottom);
      const Sample* line = samples + static_cast<std::size_t>(row - first_row) * static_cast<std::size_t>(strip_width) * kChannels;
      for (int i = 0; i < layout_.width; ++i) {
        const double left = layout_.x + i * layout_.step_x;
        const double right = left + layout_.step_x;
        const int column_end = std::min(static_cast<int>(std::ceil(right)), first_column + strip_width);
        const std::size_t cell = static_cast<std::size_t>(j) * static_cast<std::size_t>(layout_.width) + static_cast<std::size_t>(i);
        for (int column = std::max(static_cast<int>(std::floor(left)), first_column); column < column_end; ++column) {
          const Sample* sample = line + static_cast<std::size_t>(column - first_column) * kChannels;
          if (sample[0] != sample[0]) continue;  // a void height
          const double weight = row_weight * overlap(column, left, right);
          for (std::size_t c = 0; c < kChannels; ++c) sums_[cell * kChannels + c] += weight * static_cast<double>(sample[c]);
          weights_[cell] += weight;
        }
      }
    }
  }
}

void BoxAverage::add(const HeightGrid& strip, int first_column, int first_row) {
  add_samples<1>(strip.metres.data(), strip.width, strip.height, first_column, first_row);
}

void BoxAverage::add(const Image& strip, int first_column, int first_row) {
  add_samples<4>(strip.rgba.data(), strip.width, strip.height, first_column, first_row);
}

HeightGrid BoxAverage::heights() const {
  HeightGrid grid{layout_.width, layout_.height, {}};
  grid.metres.reserve(weights_.size());
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    grid.metres.push_back(weights_[i] > 0.0 ? static_cast<float>(sums_[i] / weights_[i]) : kNoHeight);
  }
  return grid;
}

Image BoxAverage::image() const {
  Image result{layout_.width, layout_.height, {}};
  result.rgba.reserve(sums_.size());
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const double weight = weights_[i / 4];
    result.rgba.push_back(weight > 0.0 ? static_cast<std::uint8_t>(sums_[i] / weight + 0.5) : std::uint8_t{0});
  }
  return result;
}

}  // namespace tellurion::raster
