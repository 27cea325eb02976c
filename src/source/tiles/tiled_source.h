// Tiles of a server by their zoom, column and row.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "geo/ellipsoid.h"
#include "source/tiles/tile_pyramid.h"

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
  std::string encoding;                ///< of heights: see height_decoder; empty: they are the first band's numbers
  int tile_size = 256;                 ///< pixels on a side
  int min_zoom = 0;
  int max_zoom = 18;
  std::optional<std::array<double, 4>> bounds;  ///< as TilePyramid::bounds
  std::optional<std::string> vertical; ///< as GdalOptions::vertical
};

/// A source over `service`; `store` brings the bytes and is shared by all. Nothing is asked of the server yet.
/// Errors: invalid_argument (template, zooms, sizes), and those of open_pyramid.
Result<std::unique_ptr<RasterSource>> open_tiles(const TileService& service, const geo::Ellipsoid& world,
                                                 std::shared_ptr<fetch::ByteStore> store);

}  // namespace tellurion::source
