// Voids of heights, filled smoothly: the surface of a thin plate under tension through the samples around each.
// Thread-safe: pure functions. What a void is filled with depends on it and on the samples within two pixels of it alone, whatever
// else the window holds: windows that overlap agree to the last bit.
// Method: Smith and Wessel (1990), Gridding with continuous curvature splines in tension, doi:10.1190/1.1442837.
#pragma once

#include "prepare/plane.h"

namespace tellurion::prepare {

struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;
};

/// How far beyond what is wanted a window has to reach, in pixels, where voids of up to `most_pixels` are filled.
constexpr int void_fill_margin(int most_pixels) { return most_pixels + 3; }

/// Fills the voids that reach into `wanted` and are at most `most_pixels` wide and high, diagonal neighbours counted. The window
/// reaches void_fill_margin beyond `wanted`, or to the edge of the raster, where the surface ends freely.
/// Takes time as the voids' area to the power of 1.5.
void fill_voids(Plane& window, const PixelBox& wanted, int most_pixels);

}  // namespace tellurion::prepare
