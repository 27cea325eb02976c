// Tiles and maps of services that say what they have: WMTS, WMS, TMS.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "geo/ellipsoid.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// What is asked of a service; what does not concern its kind is empty.
struct ServiceOptions {
  std::string url;                   ///< of the capabilities or the service; of a TMS: of its tilemapresource.xml
  std::vector<std::string> headers;  ///< "Name: value"
  SampleKind kind = SampleKind::colour;
  std::string encoding;              ///< of heights: see height_decoder
  std::string layer;                 ///< WMTS; WMS: one or several, with commas between them, the first the lowest
  std::string style;                 ///< empty: the default one; WMS: as many as layers, with commas between them
  std::string matrix_set;            ///< WMTS; empty: the first of Web Mercator, longitude and latitude, others
  std::string format;                ///< a MIME type; empty: what suits
  std::map<std::string, std::string> dimensions;  ///< WMTS's and WMS's Time and the like
  std::string version;               ///< of WMS: "1.1.1" or "1.3.0"; empty: the service's newest
  std::string crs;                   ///< of WMS; empty: as with matrix_set
  std::optional<bool> transparent;   ///< WMS; nothing: unless the layer is opaque
  int tile_size = 256;               ///< WMS: pixels on a side
  std::optional<int> least_level;    ///< 0 is the coarsest that there is
  std::optional<int> most_level;
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees
  std::optional<std::string> vertical;
};

/// These wait for the service's capabilities, for up to half a minute, unless the cache has them.
/// Errors: invalid_argument (a layer, style, matrix set, format or CRS that the service does not have: the message lists those
/// that it has), those of fetching and of parsing capabilities, those of the projection. They name the URL without credentials.
Result<std::unique_ptr<RasterSource>> open_wmts(const ServiceOptions& options, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store);
Result<std::unique_ptr<RasterSource>> open_wms(const ServiceOptions& options, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store);
Result<std::unique_ptr<RasterSource>> open_tms(const ServiceOptions& options, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store);

}  // namespace tellurion::source
