// Vector files as gdaltindex makes them, as lists of rasters.
// Thread-safe: a pure function.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/catalogue/listing.h"

namespace tellurion::source {

/// Reads the first layer of `file`, called `name`, whose features name rasters by a field `location`, `filename` or `path`; their polygons
/// are the outlines. Errors, naming the file: unsupported (no vector format that GDAL knows, or no such field), exhausted, and those
/// of Projection::create for the layer's CRS.
Result<RasterList> read_raster_index(const std::filesystem::path& file, const std::string& name, const geo::Ellipsoid& world);

}  // namespace tellurion::source
