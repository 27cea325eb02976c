// What is missing, taken from a base raster that is fitted to its surroundings, so that no seam shows.
// Thread-safe: pure functions. A value depends on what lies within kBaseFillReach of it, whatever else the window holds.
// Method: gain and offset by least squares in cells of 16 pixels, each held by its four times larger one, the largest of 128 pixels by
// gain 1 and offset 0; what then differs around a void goes on into it and fades out (delta surface fill: Grohman and others, 2006).
#pragma once

#include "prepare/plane.h"

namespace tellurion::prepare {

constexpr int kBaseFillReach = 462;  ///< pixels: two neighbours at every level of the fit's cells and of the differences'
constexpr int kBaseFillGrid = 128;   ///< windows begin at columns and rows of the raster that are multiples of it

/// The base with gains and offsets that bring it to `window`, from cells of up to kBaseFillGrid >> `finer` pixels; `finer` is 0 to 3.
/// Depends on what lies within fitted_base_reach(finer).
Plane fitted_base(const Plane& window, const Plane& base, int finer);
constexpr int fitted_base_reach(int finer) { return 3 * (kBaseFillGrid >> finer) - 16; }

/// The base as it belongs into the voids of `window`; void where the window has samples or the base has none.
/// Gains are from 0.5 to 2. Both planes have the same size.
Plane fill_from_base(const Plane& window, const Plane& base);

}  // namespace tellurion::prepare
