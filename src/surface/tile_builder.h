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
  double of_parent_error = 0.47;     ///< both together may reach this share of the parent's error: the tile is seen only where
                                     ///< that is too much; but at most four times the next
  double of_tile_size = 1.0 / 1024;  ///< and it may add this share of the tile's size, of heights and of curvature each
};

/// Geometry, slopes (if its facts say so) and metrics of a tile. metrics.height_error is the deviation of the drawn heights from
/// the finest data under the tile. Where the facts tell the grid's error, that and the decimation's are added up; else the
/// drawn triangles are compared with the data (see measured_error). `parent_error`: of the parent's heights, metres; 0: none.
/// Errors: those of reading, cancelled.
Result<TileGeometry> build_geometry(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key,
                                    double parent_error, const MeshSettings& settings = {}, std::stop_token stop = {});

}  // namespace tellurion::surface
