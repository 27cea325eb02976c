// How opaque a picture is near where its data end: it fades inwards from its border and from the edges of its voids.
// Worker side; the arithmetic is pure.
#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"
#include "cache/cached_raster.h"
#include "raster/image.h"

namespace tellurion::surface {

/// Pixels of level 0 between which a raster ends. It does not where it goes round the body, or where it ends in a point, a pole of its
/// projection: nothing lies beyond that.
struct Extent {
  glm::dvec2 lower;
  glm::dvec2 upper;

  bool holds(glm::dvec2 pixel) const { return inside(pixel) >= 0.0; }
  /// Pixels to the nearest border; negative beyond it, or NaN.
  double inside(glm::dvec2 pixel) const;
};

Extent extent_of(const source::RasterDescription& raster, source::RasterReader& reader);

/// Opacity at `pixel`: 0 on the border and beyond, 1 from `feather` pixels inwards; without a feather 1 within. NaN pixels: 0.
double opacity_at(const Extent& extent, glm::dvec2 pixel, double feather);

/// An image's pixels in level 0: pixel i lies at first + (i + 0.5) / scale.
struct ImagePlace {
  glm::dvec2 first{0.0};
  glm::dvec2 scale{1.0};
};

/// How far the places of a window are from the nearest void, in pixels of the window's level; the edge is where the void's pixel ends.
struct VoidDistances {
  ImagePlace place;
  int width = 0;
  int height = 0;
  std::vector<float> pixels;   ///< of each pixel's middle; empty: there is no void near
  double feather = 0;          ///< in these pixels

  /// Opacity at a pixel of level 0: 0 on the edge of a void, 1 from the feather on.
  double opacity_at(glm::dvec2 pixel) const;
};

/// The distances that matter to an image of `level` whose pixels of level 0 lie between `low` and `high`: at that level or, for a wide
/// feather, at one where it measures kFinestFeather pixels, so that the cost does not grow with it. Errors: those of reading.
Result<VoidDistances> find_voids(cache::CachedRaster& raster, int level, glm::dvec2 low, glm::dvec2 high, double feather);

/// Takes from the opacity of `image` what the voids ask for beyond what the border does (opacity_at), which is drawn later.
void fade_from_voids(raster::Image& image, const ImagePlace& place, const VoidDistances& voids, const Extent& extent, double feather);

/// Distances from each pixel's middle to the nearest middle of a void's pixel, row by row; infinite if there is none.
/// Felzenszwalb and Huttenlocher (2012), doi:10.4086/toc.2012.v008a019.
std::vector<float> distances_to(const std::vector<bool>& is_void, int width, int height);

inline constexpr double kFinestFeather = 64.0;   ///< pixels

}  // namespace tellurion::surface
