// Where the encoded tiles of a pyramid come from.
#pragma once

#include <string>

#include "fetch/byte_store.h"
#include "source/tiles/tile_address.h"

namespace tellurion::source {

/// How much a tile is wanted.
struct TileWish {
  double gain = 0;            ///< of several, the greatest is fetched first; see fetch::Gain
  double expected_bytes = 0;  ///< 0: unknown
};

/// Thread-safe. Never waits for the network.
class TileSupply {
 public:
  virtual ~TileSupply() = default;
  /// The tile's bytes; a file without bytes: there is no such tile.
  virtual fetch::Asked ask(const TileAddress& tile, const TileWish& wish) const = 0;
  /// The bytes proved worthless (an error page, a damaged picture): not to be kept, to be asked for again after a pause.
  virtual void reject(const TileAddress& tile, const std::string& why) const = 0;
  /// The tile as messages show it: without credentials.
  virtual std::string name_of(const TileAddress& tile) const = 0;
};

}  // namespace tellurion::source
