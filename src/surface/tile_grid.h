// Regular grids of points over a tile, and the sizes that follow from its level alone.
// Thread-safe: pure functions.
#pragma once

#include <vector>

#include "geo/ellipsoid.h"
#include "geo/tile_key.h"

namespace tellurion::surface {

/// `side` x `side` points evenly spread from (first, first) to (last, last) in tile coordinates, row by row.
struct TileLattice {
  geo::TileKey key;
  int side = 0;
  double first = 0.0;
  double last = 1.0;
};

/// A lattice's points as unit normals.
/// Points on a tile's border are the same to the bit for every tile of any level that shares it on the face.
std::vector<geo::Vector<geo::Ecef>> grid_normals(const TileLattice& lattice);

/// Length of a tile's side through its face's middle on the ground; the largest of any tile of the level.
double nominal_tile_size(const geo::Ellipsoid& ellipsoid, int level);

/// Distance of its kGridSide height samples, and of the texels of its colour and slope slots: nominal, as above.
double nominal_grid_spacing(const geo::Ellipsoid& ellipsoid, int level);
double nominal_colour_texel(const geo::Ellipsoid& ellipsoid, int level);
double nominal_slope_texel(const geo::Ellipsoid& ellipsoid, int level);

}  // namespace tellurion::surface
