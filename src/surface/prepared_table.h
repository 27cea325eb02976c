// Error tables that lie beside rasters: FILE.errors, of FILE alone. `tellurion ingest` writes them; a raster that has one is
// not scanned when it is shown, and may be of any size.
// Thread-safe: pure functions; they read files.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/raster_source.h"
#include "surface/error_table.h"

namespace tellurion::surface {

/// Where the table of a raster lies.
std::filesystem::path prepared_table_file(const std::filesystem::path& raster);

/// Names what such a table depends on: the file's length and its beginning (in what `ingest` writes, where every block lies and
/// how long it is), how its samples are read, and the body. Nothing of it tells where the file lies, or when it was written.
/// Errors: not_found (no file on this machine).
Result<std::string> prepared_revision(const source::RasterSource& raster, const geo::Ellipsoid& ellipsoid);

/// Errors: not_found (there is none); corrupt, naming the file and what to do (damaged, or made for other data).
Result<ErrorTable> load_prepared_table(const source::RasterSource& raster, const geo::Ellipsoid& ellipsoid);

}  // namespace tellurion::surface
