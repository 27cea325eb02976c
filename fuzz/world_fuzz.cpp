// World files of any bytes: read or refused with a message, and what is read comes back from what is written.
// rooms: globe
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "globe/world.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto world = globe::parse_world(text, "/folder", "fuzz.toml");
  if (!world) {
    if (world.error().message.empty()) std::abort();
    return 0;
  }
  const auto again = globe::parse_world(globe::to_toml(*world), "/folder", "again.toml");
  if (!again || again->layers.size() != world->layers.size()) std::abort();
  return 0;
}
