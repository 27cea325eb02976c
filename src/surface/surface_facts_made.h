// The facts of a surface from where its sources lie and, once it is there, their error table.
// Thread-safe: the facts are immutable.
#pragma once

#include <memory>
#include <vector>

#include "surface/elevation_model.h"
#include "surface/error_table.h"
#include "surface/surface_facts.h"

namespace tellurion::surface {

/// What is assumed of heights of which nothing is known yet: no table, or a raster too large to be scanned.
/// A grid's error is at most the terrain's relief within a cell: half its diagonal at a mean slope of 45 degrees, which no
/// known terrain exceeds over the distances concerned (100 m and more). Heights lie within those of the known bodies
/// (Challenger Deep, Olympus Mons).
inline constexpr double kAssumedSlope = 1.0;
inline constexpr float kAssumedMinHeight = -12000.0f;
inline constexpr float kAssumedMaxHeight = 22000.0f;

/// What tables say of a surface's heights.
struct KnownErrors {
  /// The table of one raster alone, which lay beside it. It holds wherever that raster is all that shows.
  struct OfRaster {
    std::shared_ptr<const source::RasterSource> raster;
    ErrorTable table;
  };
  std::shared_ptr<const ErrorTable> scanned;  ///< of all scanned layers; null: not there yet
  std::vector<OfRaster> prepared{};
};

/// `errors` of `description`; null: nothing is there yet. Where no table tells, assumptions stand in for it: under layers that are neither
/// scanned nor prepared always, and where a prepared one ends or has voids above others.
std::shared_ptr<const SurfaceFacts> make_facts(std::shared_ptr<const SurfaceDescription> description,
                                               std::shared_ptr<const KnownErrors> errors);

}  // namespace tellurion::surface
