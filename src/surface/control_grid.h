// Where the places of a colour slot lie in a source: a grid of control points in double precision, split where one grid cannot
// follow the source's projection.
#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "geo/ellipsoid.h"
#include "geo/tile_key.h"
#include "source/raster_source.h"

namespace tellurion::surface {

/// A square of the slot's quadtree: of the slot's 2^depth columns and rows of such squares, one.
struct SlotSquare {
  int depth = 0;
  int column = 0;
  int row = 0;
};

/// Part of a square, as (columns + 1) x (rows + 1) control points, row by row.
struct ControlGrid {
  bool follows = true;             ///< places interpolated between the points are right to a third of a texel; where not (round
                                   ///< a pole of the source, on the rim of its projection) it has to be sampled place by place
  int cell_texels = 0;             ///< of the slot, along a cell's side
  glm::dvec2 lower{0.0};           ///< tile coordinates of the first point
  glm::dvec2 upper{0.0};           ///< and the last
  int columns = 0;
  int rows = 0;
  std::vector<glm::dvec2> pixels;  ///< of the source's level 0, continuous across its wrap (x may lie outside the raster)
  glm::dvec2 pixels_per_texel{0};  ///< source columns and rows along their steepest direction, median of the cells
};

/// The source under a slot: grids that together hold all of the raster in the slot, and `whole` if they fill it.
struct SlotMapping {
  std::vector<ControlGrid> grids;
  bool whole = false;
};

SlotMapping map_slot(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key, const source::RasterDescription& raster,
                     source::RasterReader& reader);

}  // namespace tellurion::surface
