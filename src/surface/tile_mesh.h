// The triangles of a tile out of its grid of heights: decimated, closed by a skirt, in floats relative to its centre.
// Thread-safe: pure functions.
#pragma once

#include <span>

#include "geo/ellipsoid.h"
#include "geo/frames.h"
#include "surface/tile_content.h"

namespace tellurion::surface {

/// How far triangles may lie from the tile's own full grid, metres. Both are kept at every grid point.
struct MeshTolerance {
  double height = 0;     ///< of heights, at exaggeration 1
  double curvature = 0;  ///< of the bare ellipsoid: the sag of its arc over a triangle's edge
};

/// A mesh and how far it is from the full grid, measured after building.
struct DecimatedMesh {
  TileMesh mesh;
  double height_deviation = 0;     ///< metres at exaggeration 1
  double curvature_deviation = 0;  ///< metres
};

/// `normals` and `heights` are the tile's kGridSide^2 points row by row, `parent_heights` what the parent level shows there.
DecimatedMesh make_tile_mesh(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key,
                             std::span<const geo::Vector<geo::Ecef>> normals, std::span<const double> heights,
                             std::span<const double> parent_heights, const MeshTolerance& tolerance);

}  // namespace tellurion::surface
