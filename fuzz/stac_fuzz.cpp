// STAC items of any bytes: read or refused with a message; what is read has paths, and rings of places.
// rooms: source
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/catalogue/stac_list.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  const auto list = source::read_stac({reinterpret_cast<const char*>(data), size}, "/folder", "fuzz.json", geo::kWgs84);
  if (!list) {
    if (list.error().message.empty()) std::abort();
    return 0;
  }
  for (const source::ListedRaster& raster : list->rasters) {
    if (raster.path.empty() || !(raster.spacing.value >= 0.0 && raster.spacing.value < 1e8)) std::abort();
    if (raster.ring.size() % 2 != 0 || (!raster.ring.empty() && raster.ring.size() < 4)) std::abort();
    for (const geo::LatLon& place : raster.ring) {
      if (!(std::abs(place.latitude.value) < 1.5708) || !std::isfinite(place.longitude.value)) std::abort();
    }
  }
  return 0;
}
