// A tilemapresource.xml of any bytes: read or refused with a message; what is read makes grids that hold together.
// rooms: source
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/tiles/crs_name.h"
#include "source/tiles/service_grids.h"
#include "source/tiles/tms_resource.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::source;
  const auto map = parse_tms_resource(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!map) {
    if (map.error().message.empty()) std::abort();
    return 0;
  }
  for (const bool geographic : {false, true}) {
    const CrsAxes axes{"", geographic, geographic, 1.0, 6378137.0};
    const auto grid = tms_grid(*map, axes, crs_name(map->crs));
    if (!grid) continue;
    const auto& levels = grid->grid.levels;
    if (levels.size() != grid->hrefs.size() || levels.size() != grid->ranges.size() || levels.size() != grid->south_rows.size()) std::abort();
    for (std::size_t i = 0; i < levels.size(); ++i) {
      if (!(levels[i].pixel.x > 0.0) || levels[i].columns < 1 || levels[i].rows < 1 || grid->south_rows[i] < grid->ranges[i].most_row) std::abort();
    }
  }
  return 0;
}
