// Builds what a surface tile shows of the elevation: heights -> decimated mesh, slopes, and bounds of their errors.
// A job of a worker: values and a stop token in, a result out.
#pragma once

#include <stop_token>

#include "base/result.h"
#include "surface/elevation_model.h"
#include "surface/surface_facts.h"
#include "surface/tile_content.h"

namespace tellurion::surface {

/// How many triangles to spend. Errors add up: that of the tile's own grid, and the decimation's.
struct MeshSettings {
  double of_grid_error = 0.7;         ///< decimation may add this share of the grid's own error
  double of_tile_size = 1.0 / 8192;   ///< and at least this share of the tile's size, of heights and of curvature each
};

/// Geometry, slopes (if its facts say so) and metrics of a tile. metrics.height_error bounds the deviation of the drawn heights
/// from the finest data everywhere under the tile: the grid's error (from the facts, or from the data round it where the
/// grid is finer than they are) and the decimation's. Errors: those of reading, cancelled.
Result<TileGeometry> build_geometry(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key,
                                    const MeshSettings& settings = {}, std::stop_token stop = {});

}  // namespace tellurion::surface
