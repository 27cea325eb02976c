// The name of a tile in a pyramid.
#pragma once

#include <cstdint>

namespace tellurion::source {

/// A tile of a pyramid: level 0 is the coarsest, rows count from the north.
struct TileAddress {
  int zoom = 0;
  std::int64_t column = 0;
  std::int64_t row = 0;

  friend bool operator==(const TileAddress&, const TileAddress&) = default;
};

}  // namespace tellurion::source
