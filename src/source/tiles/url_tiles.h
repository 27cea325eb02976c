// Tiles by URL templates, through a store of bytes.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fetch/byte_store.h"
#include "source/tiles/tile_grid.h"
#include "source/tiles/tile_supply.h"
#include "source/tiles/tile_template.h"

namespace tellurion::source {

/// `key_prefix` names the tiles in caches: without credentials. `headers`: "Name: value", sent with every request.
/// `may_have` (if there is one) says which tiles may exist: others are not asked for.
std::shared_ptr<const TileSupply> url_tiles(TileTemplate address, std::vector<std::string> headers, std::string key_prefix, const TileGrid& grid,
                                            std::shared_ptr<fetch::ByteStore> store, std::function<bool(const TileAddress&)> may_have = {});

}  // namespace tellurion::source
