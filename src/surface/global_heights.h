// Heights of the whole body, so few that they are always in memory: as fine as the coarsest tiles.
// Thread-safe, immutable.
#pragma once

#include <vector>

#include "base/result.h"
#include "surface/elevation_model.h"

namespace tellurion::surface {

class GlobalHeights {
 public:
  /// kGridSide x kGridSide heights of each face of the cube: 0.4 MB, of the same samples as the coarsest tiles. Where samples are on their
  /// way they are made of zeros: see ElevationModel::take_pending. Errors: those of reading.
  static Result<GlobalHeights> make(ElevationModel& model);

  /// Bilinear between the grid's points, metres above the ellipsoid.
  double at(const geo::LatLon& place) const;
  /// Metres between the grid's points, nominal.
  double spacing() const { return spacing_; }

 private:
  GlobalHeights() = default;
  std::vector<float> metres_;  ///< face by face, row by row
  double spacing_ = 0;
};

}  // namespace tellurion::surface
