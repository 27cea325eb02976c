// One band of samples as numbers, to calculate with.
// Thread-safe as values are.
#pragma once

#include <cstdint>
#include <vector>

#include "prepare/samples.h"

namespace tellurion::prepare {

/// Rows from the north; NaN is void.
struct Plane {
  int width = 0;
  int height = 0;
  std::vector<float> values;

  float& at(int x, int y) { return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
  float at(int x, int y) const { return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
};

/// All void.
Plane void_plane(int width, int height);

/// A band, from 0 on. Where there is alpha, a pixel is void unless it is opaque.
Plane plane_of(const SampleLayout& layout, const Samples& samples, int band);

/// Puts what is not void of `plane` into the band in place of the voids there; rounded half up and within the range of the type.
/// Where there is alpha, pixels that are partly transparent are laid over the plane; make_opaque has to follow.
void fill_band(const SampleLayout& layout, Samples& samples, int band, const Plane& plane);

/// Puts what is not void of `plane` into the band where `pixels`, row by row, is not 0; as fill_band.
void replace_in_band(const SampleLayout& layout, Samples& samples, int band, const Plane& plane, const std::vector<std::uint8_t>& pixels);

/// Makes pixels opaque where `plane` is not void.
void make_opaque(const SampleLayout& layout, Samples& samples, const Plane& plane);

/// The window of `from` at column `x` and row `y`.
Samples cut_window(const SampleLayout& layout, const Samples& from, int x, int y, int width, int height);

}  // namespace tellurion::prepare
