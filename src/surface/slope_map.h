// The slopes of the elevation under a tile, for shading finer than its mesh.
#pragma once

#include <stop_token>

#include "base/result.h"
#include "surface/elevation_model.h"
#include "surface/tile_content.h"

namespace tellurion::surface {

/// kSlopeSlotSide^2 texels, gutters included, from heights at the texels' corners. Errors: those of reading, cancelled.
Result<SlopeMap> build_slopes(ElevationModel& model, const geo::TileKey& key, std::stop_token stop = {});

}  // namespace tellurion::surface
