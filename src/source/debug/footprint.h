// Debug sources: where other rasters lie.
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/catalogue/catalogue.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// Transparent but for a tint over the ground of `raster`, a line along its border, and a ring round one that is too small to be
/// seen on a picture of the whole globe. Errors: those of the projection.
Result<std::unique_ptr<RasterSource>> open_footprint(std::shared_ptr<const RasterSource> raster, const geo::Ellipsoid& world);

/// The same of many rasters, each but those that go round the globe; lines run where one begins or ends. Small ones have no ring.
Result<std::unique_ptr<RasterSource>> open_footprints(std::shared_ptr<const Catalogue> catalogue, std::string name, const geo::Ellipsoid& world);

/// The place of the middle of a raster; of its bounds where it has none.
geo::LatLon middle_of(const RasterSource& raster);

}  // namespace tellurion::source
