// A debug source: every tile of a pyramid shows its level, column and row.
#pragma once

#include <memory>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/raster_source.h"

namespace tellurion::source {

struct TileIndexOptions {
  bool geographic = false;  ///< two tiles side by side at level 0, in longitude and latitude; else Web Mercator, with one
  int tile_size = 256;      ///< pixels on a side, 32 to 1024
};

/// Transparent but for the text "level/column/row" (rows from the north) and a border line, whose colour tells the level.
/// As deep as tiles of a centimetre's or two pixels. Errors: invalid_argument (the size), unsupported (Web Mercator of another body).
Result<std::unique_ptr<RasterSource>> open_tile_index(const TileIndexOptions& options, const geo::Ellipsoid& world);

}  // namespace tellurion::source
