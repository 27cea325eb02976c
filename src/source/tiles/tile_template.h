// Addresses of tiles: a template with places for column, row and zoom.
// Thread-safe: immutable values.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "source/tiles/tile_address.h"

namespace tellurion::source {

class TileTemplate {
 public:
  /// `{z}`, `{x}`, `{y}` (rows from the north), `{-y}` (from the south, as TMS has them), `{q}` (Bing's quadkey) and `{s}`
  /// (one of `subdomains`, by the tile). Errors: invalid_argument, naming what is unknown or missing.
  static Result<TileTemplate> parse(const std::string& text, std::vector<std::string> subdomains);

  /// `rows`: of the tile's zoom.
  std::string url(const TileAddress& tile, std::int64_t rows) const;

 private:
  enum class Field { zoom, column, row, row_from_south, quadkey, subdomain };
  struct Piece {
    std::string text;  ///< before the field
    Field field;
  };
  std::vector<Piece> pieces_;
  std::string end_;
  std::vector<std::string> subdomains_;
};

}  // namespace tellurion::source
