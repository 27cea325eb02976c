// Terrain tiles of the format heightmap-1.0: a grid of 65 x 65 heights whose outermost ones lie on the tile's edges.
// Thread-safe: pure functions.
// Format: github.com/CesiumGS/cesium/wiki/heightmap-1.0
#pragma once

#include <string_view>

#include "base/result.h"
#include "raster/height_grid.h"

namespace tellurion::raster {

/// Heights at the centres of `width` x `height` pixels over the tile, bilinear between its own, in metres above the ellipsoid in steps
/// of a fifth. Reads tiles gzipped or not; the masks of children and water behind the heights are passed over.
/// Errors: corrupt; messages say what is wrong, not where. Requires 1 to 4096 columns and rows (asserted).
Result<HeightGrid> decode_heightmap_tile(std::string_view bytes, int width, int height);

}  // namespace tellurion::raster
