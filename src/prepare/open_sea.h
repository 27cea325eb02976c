// Which pixels of a raster lie in the open sea.
// Thread-safe: a pure function.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "prepare/shore.h"
#include "prepare/void_fill.h"

namespace tellurion::prepare {

/// Where a place of the raster lies, in columns and rows (pixels' centres at halves); nothing: nowhere on the body.
using PlaceOfPixel = std::function<std::optional<geo::LatLon>(double x, double y)>;

/// 1 for the pixels of `box`, row by row, that are sea and more than `metres` over ground from the coast. Pixels that lie nowhere are 0.
/// Takes time as the length of that line, in pixels.
std::vector<std::uint8_t> open_sea(const Shore& shore, const PlaceOfPixel& place, const PixelBox& box, double metres);

}  // namespace tellurion::prepare
