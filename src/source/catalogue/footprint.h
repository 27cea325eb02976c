// Where a data set lies on the globe and how fine it is, known without opening it.
// Thread-safe: immutable.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "base/quantity.h"
#include "geo/ellipsoid.h"
#include "geo/geodetic.h"
#include "geo/tile_key.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// The places of the sphere of normals within an angle of a middle.
struct SphereCap {
  glm::dvec3 middle{1.0, 0.0, 0.0};  ///< unit
  double cosine = -1.0;              ///< of the radius, an angle in [0, pi]: the whole sphere
  double sine = 0.0;
};
SphereCap cap_of(const glm::dvec3& middle, Radians radius);

bool overlap(const SphereCap& a, const SphereCap& b);

/// A rectangle on a face of the cube, as what is asked for: a tile, or the places of a batch.
struct FaceRegion {
  int face = 0;
  geo::FaceRect rect;  ///< may lie a little outside of [-1, 1]
  SphereCap cap;       ///< holds it
};
FaceRegion region_of(const geo::TileKey& tile);
FaceRegion region_of(int face, const geo::FaceRect& rect);

/// The steps into which each edge of a raster's ring is cut: even, so that the ring bends at even places.
inline constexpr int kRingSteps = 8;

class Footprint final : public Coverage {
 public:
  /// `ring` goes once round the data set, without its first place again at the end; the outline bends at even places only, and what
  /// lies between two places is nearly straight. A ring round more than most of a hemisphere counts as the whole body.
  /// `spacing`: of the samples, finest, larger axis. Requires at least four finite places (asserted) and a positive spacing.
  Footprint(std::span<const geo::LatLon> ring, Metres spacing, const geo::Ellipsoid& world);

  bool touches(const geo::TileKey& tile) const override { return touches(region_of(tile)); }
  Metres spacing_under(const geo::TileKey& tile) const override;
  bool touches(const FaceRegion& region) const;

  Metres spacing() const { return spacing_; }
  /// Angle across the data set, at most; of the whole body 2 pi.
  Radians extent() const { return extent_; }
  const SphereCap& cap() const { return cap_; }

 private:
  /// The ring in coordinates of a face.
  struct OnFace {
    int face = 0;
    geo::FaceRect rect;             ///< round all, with the margin
    double margin = 0.0;            ///< how far data may lie beyond the ring
    std::vector<glm::dvec2> ring;   ///< empty: it cannot be drawn there, and the cap alone counts
  };
  SphereCap cap_;
  Radians extent_;
  Metres spacing_;
  std::vector<OnFace> on_faces_;
};

/// The ring round a raster of `width` x `height` pixels; empty if some of it has no place.
std::vector<geo::LatLon> ring_of_raster(RasterReader& reader, const LevelSize& size);

}  // namespace tellurion::source
