// A tile's grid of heights, and how well its full triangulation shows the surface.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "surface/elevation_model.h"
#include "surface/height_error.h"

namespace tellurion::surface {

/// The finest heights under a tile, where drawn ones are held against them.
struct FinestHeights {
  std::vector<double> half_steps;       ///< at half steps of the grid, (2 * kGridSide - 1)^2
  std::vector<glm::dvec2> places;       ///< of the data's own samples, in steps of the grid
  std::vector<double> samples;

  /// Deviation of drawn heights (kGridSide^2, linear over the full triangulation); the bound is a tenth more than the
  /// largest found, for the places between: the tests look for a larger excess at random places of noise.
  HeightError deviation_of(std::span<const double> drawn) const;
};

/// kGridSide^2 points, row by row.
struct HeightField {
  std::vector<geo::Vector<geo::Ecef>> normals;
  std::vector<double> heights;
  HeightError error;          ///< of the full triangulation; the bound is one, whatever lies between the places looked at
  double judged_error = 0.0;  ///< of it, as found at those places
  FinestHeights finest;       ///< if the error was told from them
};

/// The grid of a tile that is coarser than its data, from samples about as far apart as its points.
Result<HeightField> field_of_known_error(ElevationModel& model, const geo::TileKey& key, const HeightError& error);

/// The grid of a tile that is at least as fine as its data, from the finest there are; its error is told from them.
Result<HeightField> field_of_finest_data(ElevationModel& model, const geo::TileKey& key);

/// Bound of |surface - full triangulation of the tile's grid|, for a grid that is at least as fine as the samples that the
/// surface is bilinear between. `heights` are samples of the surface at half the grid's spacing, one such step beyond
/// every border of the tile: (2 * kGridSide + 1)^2 values.
double error_between_samples(std::span<const double> heights);

}  // namespace tellurion::surface
