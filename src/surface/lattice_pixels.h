// Where a tile's lattice lies in rasters, for far less than one projection a point.
// Not thread-safe while a raster is asked: its reader belongs to one thread.
#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "geo/geodetic.h"
#include "geo/tile_key.h"
#include "source/raster_source.h"
#include "surface/tile_grid.h"

namespace tellurion::surface {

class LatticePixels {
 public:
  explicit LatticePixels(const TileLattice& lattice);

  /// Hold every point of the lattice.
  const geo::GeodeticBounds& bounds() const { return bounds_; }

  /// The lattice in one raster: continuous pixel coordinates of level 0 as RasterReader::to_pixels has them. Projected at every
  /// eighth point of a row and of a column and cubic between those (Lagrange, four points a direction), if that is within a
  /// millionth of a pixel of `level` in the middle between them, where it is worst; else projected point by point.
  class InRaster {
   public:
    /// Of the points of rows from `first_row` on, as many as there are `pixels`, a multiple of the lattice's side.
    void rows(int first_row, std::span<glm::dvec2> pixels) const;

   private:
    friend class LatticePixels;
    int side_ = 0;
    int control_side_ = 0;               ///< 0: `pixels_` are all points
    double wrap_width_ = 0;              ///< columns round the body; 0 if they do not go round
    std::vector<glm::dvec2> pixels_;
  };
  InRaster in_raster(source::RasterReader& reader, const source::RasterDescription& raster, int level) const;

 private:
  TileLattice lattice_;
  int control_side_ = 0;                  ///< 0: too few points to gain anything
  std::vector<geo::LatLon> controls_;     ///< control_side_^2, the last column and row possibly beyond the lattice
  std::vector<geo::LatLon> middles_;      ///< of the cells between them
  geo::GeodeticBounds bounds_;
};

/// Whether two bounds share a place.
bool overlap(const geo::GeodeticBounds& a, const geo::GeodeticBounds& b);

}  // namespace tellurion::surface
