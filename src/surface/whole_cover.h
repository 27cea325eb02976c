// Whether a raster hides all that lies below it under a tile.
// Worker side: uses one thread's model.
#pragma once

#include "base/result.h"
#include "geo/tile_key.h"
#include "surface/elevation_model.h"

namespace tellurion::surface {

/// Whether the model has one height layer, a raster that replaces what is below, and it covers the tile wholly: the tile lies within its
/// borders, and no sample under it is void. May say no where a void lies just beside the tile. Errors: those of reading.
Result<bool> is_covered_by_one(ElevationModel& model, const geo::TileKey& key);

}  // namespace tellurion::surface
