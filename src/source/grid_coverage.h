// Where a raster lies on the cube of tiles, from places of a lattice of its pixels.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "geo/ellipsoid.h"
#include "geo/geodetic.h"
#include "geo/tile_key.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// Places of pixels; NaN where there are none.
using ToPlaces = std::function<void(std::span<const glm::dvec2>, std::span<geo::LatLon>)>;

/// Part of a raster in continuous pixel coordinates.
struct PixelRange {
  glm::dvec2 lower;
  glm::dvec2 upper;
};

/// Cuts the raster into 32 x 32 cells and keeps, per face, the rectangle that each takes there: 5 x 5 places a cell, and
/// round them a margin of twice what the places bend off straight lines.
class GridCoverage final : public Coverage {
 public:
  GridCoverage(const PixelRange& range, const geo::Ellipsoid& world, const ToPlaces& to_places);

  bool touches(const geo::TileKey& tile) const override;
  Metres spacing_under(const geo::TileKey& tile) const override;

 private:
  struct Cell {
    geo::FaceRect rect;
    double spacing = 0.0;
  };
  struct Face {
    geo::FaceRect rect;  ///< round all cells
    std::vector<Cell> cells;
  };
  void add(int face, const Cell& cell);

  std::array<Face, geo::kFaceCount> faces_;
};

/// The smallest bounds that hold the outline of a raster of this size, and the poles where they lie within.
geo::GeodeticBounds bounds_of(const PixelRange& range, const ToPlaces& to_places);

/// Ground distance between samples at `pixel`, larger axis; infinite where it cannot be found.
Metres spacing_at(glm::dvec2 pixel, const geo::Ellipsoid& world, const ToPlaces& to_places);

}  // namespace tellurion::source
