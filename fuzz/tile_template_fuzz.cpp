// Tile URLs of any text: refused with a message, or every tile has an address without places left open.
// rooms: source
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "source/tiles/tile_template.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::source;
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const bool subdomains : {false, true}) {
    const auto made = TileTemplate::parse(text, subdomains ? std::vector<std::string>{"a", "b"} : std::vector<std::string>{});
    if (!made) {
      if (made.error().message.empty()) std::abort();
      continue;
    }
    for (const TileAddress& tile : {TileAddress{0, 0, 0}, TileAddress{30, (std::int64_t{1} << 30) - 1, 5}}) {
      if (made->url(tile, std::int64_t{1} << tile.zoom).find('{') != std::string::npos) std::abort();
    }
  }
  return 0;
}
