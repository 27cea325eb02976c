// layer.json: what a server of terrain tiles for Cesium says of them.
// Thread-safe: values and pure functions.
// Format: TileJSON 2.1 with the additions of github.com/CesiumGS/quantized-mesh
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "source/tiles/tile_address.h"

namespace tellurion::source {

enum class TerrainFormat { quantized_mesh, heightmap };

struct CesiumLayer {
  /// Tiles of one level, ends included; rows as the server counts them.
  struct Listed {
    std::int64_t first_column = 0;
    std::int64_t first_row = 0;
    std::int64_t last_column = 0;
    std::int64_t last_row = 0;
  };
  TerrainFormat format = TerrainFormat::quantized_mesh;
  bool mercator = false;            ///< EPSG:3857, one tile at level 0; otherwise EPSG:4326, two side by side
  bool rows_from_south = true;      ///< of the server's rows; false: scheme "slippyMap"
  std::string url;                  ///< of tiles, absolute, as TileTemplate reads it; may hold credentials
  int min_zoom = 0;                 ///< coarser levels hold no tiles
  std::optional<int> max_zoom;      ///< nothing: the server does not say
  /// By level. A level beyond them may hold tiles if `lists_more`: then they are listed in tiles.
  std::vector<std::vector<Listed>> available;
  bool lists_more = false;
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees, west < east
  std::string attribution;
  std::string parent_url;  ///< of the layer whose tiles stand in for those that this one lacks, absolute; empty: there is none

  /// Whether the tile may be there; `rows`: of its level.
  bool may_have(const TileAddress& tile, std::int64_t rows) const;
};

/// Reads what `url` gave; tiles are found relative to it, and its query (a key, say) is theirs on the same server.
/// Errors: corrupt (no JSON, wrong types), unsupported (format, projection, scheme), exhausted (too large); messages say what is
/// wrong, not where.
Result<CesiumLayer> parse_cesium_layer(std::string_view text, const std::string& url);

}  // namespace tellurion::source
