// Capabilities of a WMTS of any bytes: read or refused with a message; what is read makes grids that hold together.
// rooms: source
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/tiles/crs_name.h"
#include "source/tiles/service_grids.h"
#include "source/tiles/wmts_capabilities.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::source;
  const auto service = parse_wmts_capabilities(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!service) {
    if (service.error().message.empty()) std::abort();
    return 0;
  }
  for (const TileMatrixSet& set : service->matrix_sets) {
    for (const bool geographic : {false, true}) {
      const CrsAxes axes{"", geographic, geographic, 1.0, 6378137.0};
      const auto grid = matrix_grid(set, {}, axes, crs_name(set.crs), {});
      if (!grid) continue;
      const auto& levels = grid->grid.levels;
      if (levels.size() != grid->matrices.size() || levels.size() != grid->ranges.size()) std::abort();
      for (std::size_t i = 0; i < levels.size(); ++i) {
        if (!(levels[i].pixel.x > 0.0) || (i > 0 && !(levels[i].pixel.x < levels[i - 1].pixel.x))) std::abort();
      }
    }
  }
  return 0;
}
