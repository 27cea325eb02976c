// Which rasters a catalogue holds: read from a folder, a GDAL VRT, a gdaltindex file or a STAC item collection, without opening
// the rasters.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "geo/ellipsoid.h"
#include "geo/geodetic.h"

namespace tellurion::source {

/// A raster of a list. What the list does not tell of it is found by opening it.
struct ListedRaster {
  std::string path;                ///< absolute, or a URL
  std::vector<geo::LatLon> ring;   ///< see Footprint; empty: not told
  Metres spacing{0.0};             ///< of its samples, larger axis; 0: not told
};

struct RasterList {
  std::vector<ListedRaster> rasters;   ///< in the list's order; those of a folder by name
  std::vector<std::string> problems;   ///< sentences on entries that were left out
};

/// Reads the list that `path` names, by what it is: a folder (searched with its sub-folders for files that GDAL's raster drivers know by
/// their endings), *.vrt, *.json or *.geojson (STAC items, one or a collection), else a vector file as gdaltindex makes it
/// (GeoPackage, Shapefile, FlatGeobuf, ...: features with a field `location`). Relative paths in a list count from the list's folder.
/// Errors, naming the file and what to do: not_found, corrupt, unsupported, exhausted (more than kMostListed).
Result<RasterList> list_rasters(const std::filesystem::path& path, const geo::Ellipsoid& world);

inline constexpr std::size_t kMostListed = 1'000'000;

}  // namespace tellurion::source
