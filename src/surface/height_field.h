// A tile's grid of heights, and how well its full triangulation shows the surface.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "surface/elevation_model.h"

namespace tellurion::surface {

/// kGridSide^2 points, row by row.
struct HeightField {
  std::vector<geo::Vector<geo::Ecef>> normals;
  std::vector<double> heights;
  double error = 0.0;         ///< bound of |finest data - full triangulation|, metres
  std::vector<double> fine;   ///< finest heights at half steps, (2 * kGridSide - 1)^2, if the error was told from them
};

/// The grid of a tile that is coarser than its data, from samples about as far apart as its points.
Result<HeightField> field_of_known_error(ElevationModel& model, const geo::TileKey& key, double error);

/// The grid of a tile that is at least as fine as its data, from the finest there are; its error is told from them.
Result<HeightField> field_of_finest_data(ElevationModel& model, const geo::TileKey& key);

/// Largest deviation of drawn heights (kGridSide^2, linear over the full triangulation) from the finest data under a tile, found at
/// half the grid's steps (`fine`) and at all samples of the data within the tile, and a tenth more for the places between:
/// the tests look for a larger excess at random places of noise.
Result<double> measured_error(ElevationModel& model, const geo::TileKey& key, std::span<const double> drawn,
                              std::span<const double> fine);

/// Bound of |surface - full triangulation of the tile's grid|, for a grid that is at least as fine as the samples that the
/// surface is bilinear between. `heights` are samples of the surface at half the grid's spacing, one such step beyond
/// every border of the tile: (2 * kGridSide + 1)^2 values.
double error_between_samples(std::span<const double> heights);

}  // namespace tellurion::surface
