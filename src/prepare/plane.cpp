#include "prepare/plane.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

#include "prepare/typed_samples.h"

namespace tellurion::prepare {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

/// The value as a sample that is not taken for a void.
template <class T>
T sample_of(double value, const Voids<T>& voids) {
  if constexpr (std::is_floating_point_v<T>) {
    const auto sample = static_cast<T>(value);
    return voids.contains(sample) ? std::nextafter(sample, std::numeric_limits<T>::max()) : sample;
  } else {
    const auto least = static_cast<double>(std::numeric_limits<T>::lowest()), most = static_cast<double>(std::numeric_limits<T>::max());
    const T sample = static_cast<T>(std::clamp(std::floor(value + 0.5), least, most));
    if (!voids.contains(sample)) return sample;
    return static_cast<T>(sample == std::numeric_limits<T>::max() ? sample - 1 : sample + 1);
  }
}

template <class T>
constexpr T kOpaque = static_cast<T>(std::is_same_v<T, std::uint16_t> ? 65535 : 255);

/// From 0 to 1.
template <class T>
double opacity(T alpha) {
  return std::clamp(static_cast<double>(alpha) / static_cast<double>(kOpaque<T>), 0.0, 1.0);
}

}  // namespace

Plane void_plane(int width, int height) {
  return {width, height, std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kVoid)};
}

Plane plane_of(const SampleLayout& layout, const Samples& samples, int band) {
  Plane plane = void_plane(samples.width, samples.height);
  with_type(layout.type, [&](auto type) {
    using T = decltype(type);
    const Voids<T> voids(layout);
    const T* pixel = as<T>(samples);
    for (float& value : plane.values) {
      const bool opaque = !layout.alpha || opacity(pixel[layout.bands - 1]) >= 1.0;
      if (opaque && !voids.contains(pixel[band])) value = static_cast<float>(pixel[band]);
      pixel += layout.bands;
    }
  });
  return plane;
}

void fill_band(const SampleLayout& layout, Samples& samples, int band, const Plane& plane) {
  assert(plane.width == samples.width && plane.height == samples.height);
  with_type(layout.type, [&](auto type) {
    using T = decltype(type);
    const Voids<T> voids(layout);
    T* pixel = as<T>(samples);
    for (const float value : plane.values) {
      T& sample = pixel[band];
      const double share = layout.alpha ? opacity(pixel[layout.bands - 1]) : voids.contains(sample) ? 0.0 : 1.0;
      if (share < 1.0 && !std::isnan(value)) sample = sample_of(share > 0.0 ? share * static_cast<double>(sample) + (1.0 - share) * static_cast<double>(value) : static_cast<double>(value), voids);
      pixel += layout.bands;
    }
  });
}

void replace_in_band(const SampleLayout& layout, Samples& samples, int band, const Plane& plane, const std::vector<std::uint8_t>& pixels) {
  with_type(layout.type, [&](auto type) {
    using T = decltype(type);
    const Voids<T> voids(layout);
    T* sample = as<T>(samples) + band;
    for (std::size_t i = 0; i < pixels.size(); ++i, sample += layout.bands) {
      if (pixels[i] != 0 && !std::isnan(plane.values[i])) *sample = sample_of(static_cast<double>(plane.values[i]), voids);
    }
  });
}

void make_opaque(const SampleLayout& layout, Samples& samples, const Plane& plane) {
  with_type(layout.type, [&](auto type) {
    using T = decltype(type);
    T* pixel = as<T>(samples);
    for (const float value : plane.values) {
      if (!std::isnan(value)) pixel[layout.bands - 1] = kOpaque<T>;
      pixel += layout.bands;
    }
  });
}

Samples cut_window(const SampleLayout& layout, const Samples& from, int x, int y, int width, int height) {
  assert(x >= 0 && y >= 0 && x + width <= from.width && y + height <= from.height);
  Samples window = make_samples(layout, width, height);
  const std::size_t pixel = layout.pixel_bytes(), row = static_cast<std::size_t>(width) * pixel;
  for (int j = 0; j < height; ++j) {
    const std::size_t first = static_cast<std::size_t>(y + j) * static_cast<std::size_t>(from.width) + static_cast<std::size_t>(x);
    std::memcpy(window.bytes.data() + static_cast<std::size_t>(j) * row, from.bytes.data() + first * pixel, row);
  }
  return window;
}

}  // namespace tellurion::prepare
