// VRTs of any bytes: read or refused with a message; what is read has a size and, in it, files with rectangles.
// rooms: source
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/catalogue/vrt_mosaic.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  const auto mosaic = source::parse_vrt({reinterpret_cast<const char*>(data), size}, "/folder", "fuzz.vrt");
  if (!mosaic) {
    if (mosaic.error().message.empty()) std::abort();
    return 0;
  }
  if (mosaic->width < 1 || mosaic->height < 1) std::abort();
  for (const source::VrtPart& part : mosaic->parts) {
    const glm::dvec2 extent = part.upper - part.lower;
    if (part.path.empty() || !(extent.x >= 0.0 && extent.y >= 0.0) || !std::isfinite(extent.x + extent.y)) std::abort();
    if (!(part.reduction.x >= 0.0 && part.reduction.y >= 0.0)) std::abort();
  }
  return 0;
}
