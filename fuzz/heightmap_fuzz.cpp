// Heightmaps of any bytes: read or refused with a message; heights are those that 16 bits can say.
// rooms: raster
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "raster/heightmap_tile.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto grid = tellurion::raster::decode_heightmap_tile({reinterpret_cast<const char*>(data), size}, 40, 30);
  if (!grid) {
    if (grid.error().message.empty()) std::abort();
    return 0;
  }
  for (const float metres : grid->metres) {
    if (!(metres >= -1000.0f && metres <= 12107.0f)) std::abort();
  }
  return 0;
}
