// The triangles of a tile out of its grid of heights: decimated, closed by a skirt, in floats relative to its centre.
// Thread-safe: pure functions.
#pragma once

#include <span>
#include <vector>

#include "geo/ellipsoid.h"
#include "geo/frames.h"
#include "surface/tile_content.h"

namespace tellurion::surface {

/// How far triangles may lie from the tile's own full grid, metres. Both are kept at every grid point.
struct MeshTolerance {
  double height = 0;     ///< of heights, at exaggeration 1
  double curvature = 0;  ///< of the bare ellipsoid: the sag of its arc over a triangle's edge
};

/// How many triangulations a mesh gets, and how large it may become.
struct MeshLimits {
  double step_ratio = 1.3;              ///< of the tolerances of one triangulation and the one before it
  int most_steps = kMostMeshSteps;
  std::size_t most_triangles = 16384;   ///< of the finest; tolerances rise until it is kept
};

/// How far a triangulation is from the full grid, measured after building.
struct DecimatedStep {
  std::vector<double> drawn;        ///< heights that the triangles show at the grid's points; between them they are linear over
                                    ///< the full triangulation (see interpolate_in_triangles)
  double height_deviation = 0;      ///< of heights, metres at exaggeration 1; sideways_deviation included
  double sideways_deviation = 0;    ///< the part of it that comes from flat triangles shifting what they show sideways
  double curvature_deviation = 0;   ///< metres; the rounding of vertices to floats included
};

struct DecimatedMesh {
  TileMesh mesh;
  std::vector<DecimatedStep> steps;  ///< of the mesh's steps
};

/// A mesh of several triangulations, each with fewer triangles than the one before, the finest within `tolerance`.
/// `normals` and `heights` are the tile's kGridSide^2 points row by row, `parent_heights` what the parent level shows there.
DecimatedMesh make_tile_mesh(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key,
                             std::span<const geo::Vector<geo::Ecef>> normals, std::span<const double> heights,
                             std::span<const double> parent_heights, const MeshTolerance& tolerance,
                             const MeshLimits& limits = {});

}  // namespace tellurion::surface
