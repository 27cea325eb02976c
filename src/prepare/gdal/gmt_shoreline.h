// The shorelines of GSHHG as GMT packs them: netCDF files (binned_GSHHS_*.nc) whose lines are cut at the borders of square bins.
// Thread-safe: a pure function, while no other thread uses the data set.
#pragma once

#include <string>

#include <gdal_priv.h>

#include "base/result.h"
#include "prepare/shore.h"

namespace tellurion::prepare {

/// The land of a data set that was opened for GDAL_OF_MULTIDIM_RASTER, on WGS 84: all within shorelines of level 1. Lakes are land, and so are
/// Antarctica's ice shelves. Rings go on past the 180th meridian.
/// Errors: unsupported (another netCDF file), corrupt; both name `path` and what to do.
/// Reads no array of more than three times the values of the finest file, which is how memory is bounded.
Result<Land> read_gmt_shoreline(GDALDataset& dataset, const std::string& path);

}  // namespace tellurion::prepare
