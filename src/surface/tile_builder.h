// Builds what a surface tile shows of the elevation: heights -> decimated mesh, slopes, and bounds of their errors.
// A job of a worker: values and a stop token in, a result out.
#pragma once

#include <stop_token>

#include "base/result.h"
#include "surface/elevation_model.h"
#include "surface/surface_facts.h"
#include "surface/tile_content.h"
#include "surface/tile_mesh.h"

namespace tellurion::surface {

/// How many triangles to spend on the finest triangulation. Errors add up: that of the tile's own grid, and the decimation's.
struct MeshSettings {
  double of_grid_error = 0.8;        ///< decimation may add this share of the grid's own error (see judged)
  double of_tile_size = 1.0 / 1024;  ///< and at least this share of the tile's size, of heights and of curvature each
  MeshLimits limits;
};

/// Geometry, slopes (if its facts say so) and metrics of a tile. Where the facts tell the grid's error, that and the
/// decimation's are added up; else the drawn triangles are compared with the data (see FinestHeights).
/// Errors: those of reading, cancelled.
Result<TileGeometry> build_geometry(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key,
                                    const MeshSettings& settings = {}, std::stop_token stop = {});

}  // namespace tellurion::surface
