// GDAL as this process uses it: no network, no output of its own, errors as text.
#pragma once

#include <string>

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include "base/result.h"

namespace tellurion::source {

/// While it lives, GDAL's messages on this thread are kept here instead of being printed.
class QuietErrors {
 public:
  QuietErrors();
  ~QuietErrors();
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

  /// The last error, on one line; empty if there was none.
  const std::string& last() const { return last_; }

 private:
  std::string last_;
};

/// Registers drivers and switches the network off; once per process, safe to call again.
void prepare_gdal();

/// The CRS as WKT 2 of 2019; empty if it cannot be written so.
std::string wkt_of(const OGRSpatialReference& crs);

/// Opens a raster data set read-only, for one thread.
/// Errors: not_found, unsupported, corrupt; all name `path`.
Result<GDALDatasetUniquePtr> open_dataset(const std::string& path);

}  // namespace tellurion::source
