// Ever coarser grids of a raster's heights, for places that its finer levels know nothing of.
// Thread-safe: values.
#pragma once

#include <glm/vec2.hpp>

#include "base/result.h"
#include "cache/cached_raster.h"
#include "raster/height_grid.h"

namespace tellurion::surface {

/// Half a grid's samples, or fewer: means of those that are valid.
raster::HeightGrid halved(const raster::HeightGrid& fine);

/// A level of a raster that its source does not have.
struct CoarseHeights {
  raster::HeightGrid grid;
  glm::dvec2 scale{1.0};  ///< its pixels per pixel of the raster's level 0

  /// As CachedRaster::sample_heights, within the raster; nothing lies beyond its borders, columns do not wrap.
  cache::HeightSample sample(glm::dvec2 pixel) const;
};

/// The last level of a raster, as it is. Errors: those of reading.
Result<CoarseHeights> last_level(cache::CachedRaster& raster);

/// The level after `fine`.
CoarseHeights next_level(const CoarseHeights& fine);

}  // namespace tellurion::surface
