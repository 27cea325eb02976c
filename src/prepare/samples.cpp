#include "prepare/samples.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "prepare/typed_samples.h"

namespace tellurion::prepare {
namespace {

template <class T>
using Sum = std::conditional_t<std::is_same_v<T, float>, float, std::conditional_t<std::is_same_v<T, double>, double, std::int64_t>>;

template <class T>
T mean_of(Sum<T> sum, int count) {
  if constexpr (std::is_floating_point_v<T>) {
    return sum / static_cast<T>(count);
  } else {  // half up, also below zero
    const std::int64_t twice = 2 * sum + count, whole = 2 * std::int64_t{count};
    return static_cast<T>(twice >= 0 ? twice / whole : -((-twice + whole - 1) / whole));
  }
}

/// The columns of a row of `coarse` that have two columns under them are `pairs`; one more may have one.
template <class T>
void halve_values(const SampleLayout& layout, const Samples& fine, Samples& coarse) {
  const Voids<T> voids(layout);
  const auto bands = static_cast<std::size_t>(layout.bands), row = static_cast<std::size_t>(fine.width) * bands;
  T* out = as<T>(coarse);
  for (int y = 0; y < coarse.height; ++y) {
    const T* upper = as<T>(fine) + static_cast<std::size_t>(2 * y) * row;
    const T* lower = 2 * y + 1 < fine.height ? upper + row : nullptr;
    for (int x = 0; x < coarse.width; ++x) {
      const std::size_t left = static_cast<std::size_t>(2 * x) * bands;
      const bool pair = 2 * x + 1 < fine.width;
      for (std::size_t band = 0; band < bands; ++band, ++out) {
        Sum<T> sum{};
        int count = 0;
        const auto add = [&](T sample) {
          if (voids.contains(sample)) return;
          sum += static_cast<Sum<T>>(sample);
          ++count;
        };
        const std::size_t at = left + band;
        add(upper[at]);
        if (pair) add(upper[at + bands]);
        if (lower != nullptr) add(lower[at]);
        if (lower != nullptr && pair) add(lower[at + bands]);
        *out = count == 0 ? voids.value() : mean_of<T>(sum, count);
      }
    }
  }
}

template <class T>
void halve_with_alpha(const SampleLayout& layout, const Samples& fine, Samples& coarse) {
  const int colours = layout.bands - 1;
  const auto bands = static_cast<std::size_t>(layout.bands);
  T* out = as<T>(coarse);
  for (int y = 0; y < coarse.height; ++y) {
    for (int x = 0; x < coarse.width; ++x, out += bands) {
      std::array<const T*, 4> under{};
      int count = 0;
      for (int row = 2 * y; row < std::min(2 * y + 2, fine.height); ++row) {
        for (int column = 2 * x; column < std::min(2 * x + 2, fine.width); ++column) {
          under[static_cast<std::size_t>(count++)] = as<T>(fine) + (static_cast<std::size_t>(row) * static_cast<std::size_t>(fine.width) + static_cast<std::size_t>(column)) * bands;
        }
      }
      double alpha = 0.0;
      for (int i = 0; i < count; ++i) alpha += static_cast<double>(under[static_cast<std::size_t>(i)][colours]);
      for (int band = 0; band <= colours; ++band) {
        double value = 0.0;
        if (band == colours) {
          value = alpha / count;
        } else if (alpha > 0.0) {
          for (int i = 0; i < count; ++i) {
            const T* pixel = under[static_cast<std::size_t>(i)];
            value += static_cast<double>(pixel[band]) * (static_cast<double>(pixel[colours]) / alpha);
          }
        }
        if constexpr (std::is_floating_point_v<T>) out[band] = static_cast<T>(value);
        else out[band] = static_cast<T>(std::floor(value + 0.5 + 1e-9));
      }
    }
  }
}

}  // namespace

Samples make_samples(const SampleLayout& layout, int width, int height) {
  return {width, height, std::vector<std::byte>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * layout.pixel_bytes())};
}

Samples make_blank(const SampleLayout& layout, int width, int height) {
  Samples samples = make_samples(layout, width, height);
  if (!layout.no_data) return samples;
  with_type(layout.type, [&](auto sample) {
    using T = decltype(sample);
    T* first = as<T>(samples);
    std::fill(first, first + samples.bytes.size() / sizeof(T), Voids<T>(layout).value());
  });
  return samples;
}

void BandStatistics::add(const BandStatistics& other) {
  if (other.count == 0) return;
  least = count == 0 ? other.least : std::min(least, other.least);
  most = count == 0 ? other.most : std::max(most, other.most);
  sum += other.sum;
  sum_of_squares += other.sum_of_squares;
  count += other.count;
}

Samples halve(const SampleLayout& layout, const Samples& fine) {
  Samples coarse = make_samples(layout, (fine.width + 1) / 2, (fine.height + 1) / 2);
  with_type(layout.type, [&](auto sample) {
    using T = decltype(sample);
    if (layout.alpha) halve_with_alpha<T>(layout, fine, coarse);
    else halve_values<T>(layout, fine, coarse);
  });
  return coarse;
}

Samples cut_block(const SampleLayout& layout, const Samples& from, int x, int y, int side) {
  assert(x < from.width && y < from.height);
  Samples block = make_samples(layout, side, side);
  const std::size_t pixel = layout.pixel_bytes(), row = static_cast<std::size_t>(side) * pixel;
  const int columns = std::min(side, from.width - x);
  for (int j = 0; j < side; ++j) {
    std::byte* to = block.bytes.data() + static_cast<std::size_t>(j) * row;
    const auto line = static_cast<std::size_t>(std::min(y + j, from.height - 1));
    std::memcpy(to, from.bytes.data() + (line * static_cast<std::size_t>(from.width) + static_cast<std::size_t>(x)) * pixel, static_cast<std::size_t>(columns) * pixel);
    for (int i = columns; i < side; ++i) std::memcpy(to + static_cast<std::size_t>(i) * pixel, to + static_cast<std::size_t>(columns - 1) * pixel, pixel);
  }
  return block;
}

bool is_blank(const SampleLayout& layout, const Samples& samples) {
  return with_type(layout.type, [&](auto sample) {
    using T = decltype(sample);
    const T* first = as<T>(samples);
    const T* last = first + samples.bytes.size() / sizeof(T);
    const Voids<T> voids(layout);
    if (voids.has_value()) return std::all_of(first, last, [&](T value) { return value == voids.value(); });
    if constexpr (std::is_floating_point_v<T>) {
      if (layout.no_data) return std::all_of(first, last, [](T value) { return std::isnan(value); });
    }
    return std::all_of(samples.bytes.begin(), samples.bytes.end(), [](std::byte byte) { return byte == std::byte{0}; });
  });
}

void clean(const SampleLayout& layout, Samples& samples) {
  if (!is_float(layout.type)) return;
  with_type(layout.type, [&](auto sample) {
    using T = decltype(sample);
    if constexpr (std::is_floating_point_v<T>) {
      const T value = Voids<T>(layout).value();
      T* first = as<T>(samples);
      std::replace_if(first, first + samples.bytes.size() / sizeof(T), [](T one) { return !std::isfinite(one); }, value);
    }
  });
}

std::vector<BandStatistics> statistics(const SampleLayout& layout, const Samples& samples) {
  std::vector<BandStatistics> result(static_cast<std::size_t>(layout.bands));
  with_type(layout.type, [&](auto sample) {
    using T = decltype(sample);
    const Voids<T> voids(layout);
    const auto bands = static_cast<std::size_t>(layout.bands);
    const T* first = as<T>(samples);
    const std::size_t pixels = static_cast<std::size_t>(samples.width) * static_cast<std::size_t>(samples.height);
    for (std::size_t band = 0; band < bands; ++band) {
      T least = std::numeric_limits<T>::max(), most = std::numeric_limits<T>::lowest();
      double sum = 0.0, squares = 0.0;
      std::uint64_t count = 0;
      for (std::size_t i = 0; i < pixels; ++i) {
        const T value = first[i * bands + band];
        if (voids.contains(value) || (layout.alpha && band + 1 < bands && first[i * bands + bands - 1] == T{0})) continue;
        least = std::min(least, value);
        most = std::max(most, value);
        const auto number = static_cast<double>(value);
        sum += number;
        squares += number * number;
        ++count;
      }
      if (count > 0) result[band] = {static_cast<double>(least), static_cast<double>(most), sum, squares, count};
    }
  });
  return result;
}

}  // namespace tellurion::prepare
