// Which body a raster is of.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/raster_source.h"

namespace tellurion::source {

struct RasterBody {
  geo::Ellipsoid ellipsoid;  ///< of the raster's own CRS
  SampleKind kind = SampleKind::colour;  ///< what its samples look like
};

/// Looks into a raster before a world is chosen for it. Errors: as opening it (not_found, unsupported, corrupt).
Result<RasterBody> body_of_raster(const std::filesystem::path& file);

}  // namespace tellurion::source
