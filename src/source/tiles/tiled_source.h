// Pyramids of tiles on a server, in Web Mercator or geographic coordinates.
#pragma once

#include <array>
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

/// How the tiles cut the map.
enum class TileScheme {
  web_mercator,  ///< EPSG:3857, one tile at zoom 0
  geographic,    ///< longitude and latitude, two tiles side by side at zoom 0
};

struct TileService {
  std::string url;                     ///< see TileTemplate
  std::vector<std::string> subdomains;
  std::vector<std::string> headers;    ///< "Name: value"
  TileScheme scheme = TileScheme::web_mercator;
  SampleKind kind = SampleKind::colour;
  std::optional<raster::HeightCode> code;  ///< of heights in pictures; nothing: heights are the first band's numbers
  int tile_size = 256;                 ///< pixels on a side
  int min_zoom = 0;
  int max_zoom = 18;
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees, west < east: nothing lies outside
  std::optional<std::string> vertical; ///< as GdalOptions::vertical; only "ellipsoid" so far
};

/// A source over `service`; `store` brings the bytes and is shared by all. Nothing is asked of the server yet.
/// Its readers answer `pending` while tiles are on their way. A tile that does not exist shows what the coarser ones hold.
/// Errors: invalid_argument (template, zooms, sizes), those of the projection.
Result<std::unique_ptr<RasterSource>> open_tiles(const TileService& service, const geo::Ellipsoid& world,
                                                 std::shared_ptr<fetch::ByteStore> store);

}  // namespace tellurion::source
