// Rasters that GDAL opens, in any projection that PROJ knows.
// GDAL's own network access is off; its block cache is bounded by configure_gdal.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// What a world file may say of a raster, over what the file itself says.
struct GdalOptions {
  std::string path;
  std::optional<SampleKind> kind{};
  std::optional<std::string> crs{};        ///< anything that PROJ understands; for files that declare none or a wrong one
  std::optional<std::string> vertical{};   ///< "ellipsoid", "egm96" or another vertical CRS that PROJ knows (e.g. "EPSG:5773")
  std::optional<double> no_data{};
  std::optional<double> scale{};           ///< value = sample * scale + offset; else the file's own
  std::optional<double> offset{};
  std::optional<std::array<int, 3>> rgb_bands{};  ///< 1-based
  std::optional<std::array<double, 4>> bounds{};  ///< west, south, east, north in degrees: where it lies, whatever it says itself
  std::string unpack_folder{};             ///< for copies of rasters that cannot be read in parts; empty: no copies
};

/// Process-wide set-up: drivers, no network, block cache of `block_cache_bytes`. Safe to call again.
void configure_gdal(std::size_t block_cache_bytes);
/// What its block cache holds now.
std::size_t gdal_cache_bytes();

/// Opens a raster for a world whose body is `world`.
/// Errors, each naming the file and what to do: not_found; unsupported (no raster, no georeference, not a supported layout);
/// corrupt; invalid_argument (its CRS is of another body; unknown CRS or datum in `options`).
Result<std::unique_ptr<RasterSource>> open_gdal(const GdalOptions& options, const geo::Ellipsoid& world);

/// Opens a GeoTIFF at a URL, options.path, of which only the parts that are shown are fetched, each once; that takes a tiled file
/// with overviews (a COG) on a server of HTTP ranges. Waits for its directories; its readers answer `pending` while samples are on
/// their way. Errors: as open_gdal's and RemoteFile's; unsupported (large and without overviews).
Result<std::unique_ptr<RasterSource>> open_cog(const GdalOptions& options, const std::vector<std::string>& headers, const geo::Ellipsoid& world,
                                               std::shared_ptr<fetch::ByteStore> store);

}  // namespace tellurion::source
