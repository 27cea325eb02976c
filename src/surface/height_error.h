// How far drawn heights are from the true ones, as the cut judges it.
// Thread-safe: values.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace tellurion::surface {

/// Deviation of heights from the finest data under a tile, metres at exaggeration 1.
struct HeightError {
  float bound = 0;   ///< nowhere more
  float common = 0;  ///< not more over 99 hundredths of the tile's area; at most `bound`

  friend bool operator==(const HeightError&, const HeightError&) = default;
};

/// The one number that is held against the wanted screen-space error: 99 hundredths of a tile are within it where it is
/// nearest to the eye, and nothing is off by more than twice as much. Since most of a tile is farther away and most tiles are
/// better than need be, 999 thousandths of a picture are within it (docs/decisions/0002 has the figures). A bound alone lets
/// single creases and cliffs decide for whole tiles.
inline float judged(const HeightError& error) { return std::max(error.common, error.bound / 2); }

/// The larger of each.
inline HeightError larger(const HeightError& a, const HeightError& b) {
  return {std::max(a.bound, b.bound), std::max(a.common, b.common)};
}

/// Counts deviations, with a 32nd of an octave as resolution of all but the largest.
class DeviationTally {
 public:
  void add(double metres) {
    largest_ = std::max(largest_, metres);
    counts_[bin_of(metres)] += 1.0;
  }
  /// Adds what `part` counted, `weight` for each.
  void add(const DeviationTally& part, double weight);

  double largest() const { return largest_; }
  double count() const;
  /// What at most a hundredth of the deviations exceeds, rounded up.
  double common() const;

 private:
  static constexpr int kBinsPerOctave = 32;
  static constexpr int kLowestExponent = -8;  ///< below 4 mm all is one
  static constexpr std::size_t kBins = 24 * kBinsPerOctave;

  static std::size_t bin_of(double metres) {
    // The exponent and the first five bits of a float's fraction.
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(static_cast<float>(metres)) >> 18;
    constexpr std::uint32_t kFirst = (127 + kLowestExponent) * kBinsPerOctave;
    return bits < kFirst ? 0 : std::min<std::size_t>(bits - kFirst + 1, kBins - 1);
  }
  static double upper_edge(std::size_t bin) {
    const auto octave = static_cast<int>(bin / kBinsPerOctave);
    return std::ldexp(1.0 + static_cast<double>(bin % kBinsPerOctave) / kBinsPerOctave, octave + kLowestExponent);
  }

  std::array<double, kBins> counts_{};
  double largest_ = 0.0;
};

inline void DeviationTally::add(const DeviationTally& part, double weight) {
  largest_ = std::max(largest_, part.largest_);
  for (std::size_t i = 0; i < kBins; ++i) counts_[i] += weight * part.counts_[i];
}

inline double DeviationTally::count() const {
  double sum = 0.0;
  for (const double count : counts_) sum += count;
  return sum;
}

inline double DeviationTally::common() const {
  const double allowed = count() / 100.0;
  double above = 0.0;
  for (std::size_t bin = kBins; bin-- > 0;) {
    above += counts_[bin];
    if (above > allowed) return std::min(upper_edge(bin), largest_);
  }
  return 0.0;
}

}  // namespace tellurion::surface
