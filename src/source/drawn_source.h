// Rasters that are drawn when they are asked for, at any level: no file behind them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "raster/image.h"
#include "source/proj/pixel_mapping.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// Premultiplied.
using Ink = std::array<std::uint8_t, 4>;
inline constexpr Ink kNoInk{0, 0, 0, 0};
inline constexpr Ink kBlackInk{0, 0, 0, 255};
inline constexpr Ink kWhiteInk{255, 255, 255, 255};

/// What a drawing is. `draw` is called on many threads at a time; what it gives for the same arguments changes only with the layer (Globe::refresh_layer).
struct Drawing {
  std::string name;      ///< also its revision: two drawings of a name are the same
  Georeference georeference;          ///< of level 0
  std::vector<LevelSize> levels;
  std::function<raster::Image(int level, const PixelWindow& window)> draw;
};

/// Levels of a drawing of `width` x `height` pixels: each half of the one before, down to one that fits into a block.
std::vector<LevelSize> halved_levels(LevelSize full);

/// A source over the drawing. Errors: those of the projection, naming the drawing.
Result<std::unique_ptr<RasterSource>> open_drawing(Drawing drawing, const geo::Ellipsoid& world);

}  // namespace tellurion::source
