// Rectangles of samples of any type, as they are prepared: read, halved, compressed.
// Thread-safe as values are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace tellurion::prepare {

enum class SampleType { u8, u16, i16, u32, i32, f32, f64 };

constexpr std::size_t bytes_of(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return 1;
    case SampleType::u16:
    case SampleType::i16:
      return 2;
    case SampleType::u32:
    case SampleType::i32:
    case SampleType::f32:
      return 4;
    case SampleType::f64:
      return 8;
  }
  return 0;
}

constexpr bool is_float(SampleType type) { return type == SampleType::f32 || type == SampleType::f64; }

/// What a pixel is made of.
struct SampleLayout {
  SampleType type = SampleType::f32;
  int bands = 1;                   ///< the last one is alpha if `alpha`
  bool alpha = false;
  std::optional<double> no_data{}; ///< NaN too is no data, whether this is set or not

  std::size_t pixel_bytes() const { return bytes_of(type) * static_cast<std::size_t>(bands); }
};

/// Rows from the north, the bands of a pixel side by side.
struct Samples {
  int width = 0;
  int height = 0;
  std::vector<std::byte> bytes;
};

/// All zeros.
Samples make_samples(const SampleLayout& layout, int width, int height);
/// Nothing but voids; zeros where there is no value for them.
Samples make_blank(const SampleLayout& layout, int width, int height);

/// Of the samples that are not void.
struct BandStatistics {
  double least = 0.0;
  double most = 0.0;
  double sum = 0.0;
  double sum_of_squares = 0.0;
  std::uint64_t count = 0;  ///< 0: the others say nothing

  void add(const BandStatistics& other);
};

/// Half as many columns and rows, odd ones rounded up: each sample the mean of the up to four under it, voids left out;
/// integers are rounded half up; colours count by their alpha. A sample over nothing but voids is void.
Samples halve(const SampleLayout& layout, const Samples& fine);

/// The block of `side` x `side` pixels at column `x` and row `y`; what lies beyond the edges repeats them.
Samples cut_block(const SampleLayout& layout, const Samples& from, int x, int y, int side);

/// Whether a reader that finds no block there would show the same: nothing but voids, or zeros where there is no value for voids.
bool is_blank(const SampleLayout& layout, const Samples& samples);

/// Infinities and NaN become the value of voids, or NaN where there is none.
void clean(const SampleLayout& layout, Samples& samples);

/// One for each band.
std::vector<BandStatistics> statistics(const SampleLayout& layout, const Samples& samples);

}  // namespace tellurion::prepare
