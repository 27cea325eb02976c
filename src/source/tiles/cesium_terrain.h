// Terrain of servers for Cesium: tiles of quantized-mesh or heightmap, described by a layer.json.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "geo/ellipsoid.h"
#include "source/raster_source.h"

namespace tellurion::source {

struct CesiumTerrain {
  std::string url;                      ///< of the layer.json
  std::vector<std::string> headers;     ///< "Name: value"
  int tile_size = 128;                  ///< pixels on a side that a tile is turned into: twice the samples of a heightmap
  std::optional<int> max_zoom;          ///< the finest level to use; needed where the layer names none
  std::optional<std::string> vertical;  ///< as GdalOptions::vertical; nothing: the ellipsoid, as the formats have it
};

/// A source over the tiles that the layer.json names, which is fetched and waited for. Tiles that it does not list are not asked for.
/// Errors: those of fetch_now and parse_cesium_layer, invalid_argument (no level known, sizes), those of open_pyramid.
Result<std::unique_ptr<RasterSource>> open_cesium_terrain(const CesiumTerrain& terrain, const geo::Ellipsoid& world,
                                                          std::shared_ptr<fetch::ByteStore> store);

}  // namespace tellurion::source
