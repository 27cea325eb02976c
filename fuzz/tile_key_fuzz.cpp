// Names of tiles from the outside: tile keys and quadkeys. What is accepted must be valid and read back the same.
// rooms: geo
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "geo/schemes.h"
#include "geo/tile_key.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::geo;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto key = parse_tile_key(text)) {
    if (!is_valid(*key) || to_string(*key) != text) std::abort();
  }
  if (const auto key = parse_quadkey(text)) {
    if (!is_valid(MapScheme::web_mercator, *key) || quadkey(*key) != text) std::abort();
  }
  return 0;
}
