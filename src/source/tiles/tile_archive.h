// Archives of tiles: MBTiles, GeoPackage, PMTiles.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "geo/ellipsoid.h"
#include "raster/height_codes.h"
#include "source/raster_source.h"

namespace tellurion::source {

struct TileArchive {
  std::filesystem::path file;
  std::string url{};                         ///< PMTiles on a server, instead of `file`
  std::vector<std::string> headers{};        ///< "Name: value", sent with every request
  std::string table{};                       ///< GeoPackage: which of several; empty: the only one
  SampleKind kind = SampleKind::colour;
  std::string encoding{};            ///< of heights: see height_decoder
  std::optional<std::array<double, 4>> bounds{};  ///< as TilePyramid::bounds; over what the archive says
  std::optional<std::string> vertical{};     ///< as GdalOptions::vertical
};

/// Errors of all three, naming the archive and what to do: not_found; corrupt; unsupported (vector tiles, an encoding or grid that is
/// not read); exhausted; unavailable; and those of open_pyramid.

/// Web Mercator tiles in an SQLite database. Format: https://github.com/mapbox/mbtiles-spec/blob/master/1.3/spec.md
Result<std::unique_ptr<RasterSource>> open_mbtiles(const TileArchive& archive, const geo::Ellipsoid& world);

/// Tiles in any CRS and grid, and gridded heights, in an SQLite database. Formats: https://www.geopackage.org/spec131/ (tiles),
/// https://docs.ogc.org/is/17-066r1/17-066r1.html (heights)
Result<std::unique_ptr<RasterSource>> open_geopackage(const TileArchive& archive, const geo::Ellipsoid& world);

/// Web Mercator tiles in a file with an index, here or on a server of HTTP ranges; waits for the begin of a remote one. See pmtiles.h.
/// `store` brings the parts of a remote one.
Result<std::unique_ptr<RasterSource>> open_pmtiles(const TileArchive& archive, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store);

}  // namespace tellurion::source
