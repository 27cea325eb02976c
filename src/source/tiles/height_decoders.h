// Encodings of tiles of heights, by their names in world files.
// Thread-safe: pure functions.
#pragma once

#include <string>
#include <string_view>

#include "source/tiles/tile_grid.h"
#include "source/tiles/tile_pyramid.h"

namespace tellurion::source {

inline constexpr std::string_view kQuantizedMesh = "quantized-mesh";
inline constexpr std::string_view kHeightmap = "heightmap";

/// Whether height_decoder knows it: the two above, and the names of raster::HeightCode.
bool is_height_encoding(std::string_view name);

/// The names, for messages.
std::string height_encodings();

/// Decodes tiles of `grid`; without a name heights are the first band's numbers. Requires a name that is known (asserted).
HeightDecoder height_decoder(std::string_view encoding, const TileGrid& grid);

}  // namespace tellurion::source
