#include "source/gdal/raster_body.h"

#include <cmath>

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include "source/gdal/gdal_layout.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::source {

Result<RasterBody> body_of_raster(const std::filesystem::path& file) {
  GdalOptions options;
  options.path = file.string();
  const auto dataset = open_dataset(options.path);
  if (!dataset) return dataset.error();
  RasterBody body;
  const OGRSpatialReference* crs = (*dataset)->GetSpatialRef();
  if (crs) {
    OGRErr failure = OGRERR_NONE;
    const double a = crs->GetSemiMajor(&failure);
    const double b = failure == OGRERR_NONE ? crs->GetSemiMinor(&failure) : 0.0;
    if (failure == OGRERR_NONE && a > 0.0 && b > 0.0 && b <= a) body.ellipsoid = {Metres(a), Metres(b)};
  }
  // What has no CRS is told so by this.
  const auto layout = inspect(*dataset.value(), options, body.ellipsoid);
  if (!layout) return layout.error();
  body.kind = layout->description.kind;
  return body;
}

}  // namespace tellurion::source
