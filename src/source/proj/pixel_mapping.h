// Pixels of a raster <-> places: its affine geotransform and its projection in one.
// Not thread-safe: every reader has its own.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "geo/geodetic.h"
#include "source/proj/projection.h"

namespace tellurion::source {

/// As GDAL has it: x = t[0] + column t[1] + row t[2], y = t[3] + column t[4] + row t[5]; (0, 0) is the outer corner.
using GeoTransform = std::array<double, 6>;

/// Where a raster says that it lies. A value, for making mappings from.
struct Georeference {
  std::string crs;
  GeoTransform transform{};
  int width = 0;
  int height = 0;
};

class PixelMapping {
 public:
  /// Errors: unsupported (a geotransform that cannot be inverted), and those of Projection::create.
  static Result<PixelMapping> create(const Georeference& georeference, const geo::Ellipsoid& world);

  const CrsFacts& facts() const { return projection_.facts(); }
  /// Column `width` is column 0 again, within a tenth of a pixel.
  bool wraps() const { return wraps_; }

  /// As RasterReader has them.
  void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels);
  void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places);
  geo::LatLon to_place(glm::dvec2 pixel);

 private:
  PixelMapping(Projection projection, const Georeference& georeference);

  Projection projection_;
  GeoTransform forward_{};
  GeoTransform inverse_{};
  int width_ = 0;
  double period_ = 0.0;  ///< columns round the body; 0 if columns do not go round
  bool wraps_ = false;
  std::vector<glm::dvec2> coordinates_;  ///< room to work in
};

}  // namespace tellurion::source
