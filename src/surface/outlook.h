// What the roughness of a tile's grid foretells of finer data, where these are on a server and nobody has seen all of them.
// Thread-safe: pure functions.
//
// Halving a grid's spacing changes its surface by less each time; terrain keeps the ratio of one change to the next over many
// levels (it is self-similar: Mandelbrot 1967, doi:10.1126/science.156.3775.636). The change from the half grid to the grid and
// that from the quarter grid to the half grid are measured in the tile, and their ratio is continued.
#pragma once

#include <span>
#include <vector>

#include "surface/tile_content.h"

namespace tellurion::surface {

struct Foretold {
  HeightError error;  ///< of the tile's own full grid against what is finer
  Outlook outlook;
};

/// `heights`: kGridSide^2 points of a tile, row by row, metres.
Foretold foretell(std::span<const double> heights);

/// Every other point of every other row of a grid of odd side.
std::vector<double> every_other(std::span<const double> heights, int side);

}  // namespace tellurion::surface
