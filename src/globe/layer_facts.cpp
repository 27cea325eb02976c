#include "globe/layer_facts.h"

#include <utility>

#include "source/debug/footprint.h"

namespace tellurion::globe {

Result<source::RasterStatistics> statistics_of(const LayerInfo& layer, double most_samples) { return source::statistics_of(*layer.raster, most_samples); }

Result<ShownFootprints> with_footprints(World world, const std::vector<LayerInfo>& layers) {
  ShownFootprints shown{std::move(world), {}};
  for (const LayerInfo& layer : layers) {
    if (!layer.raster) continue;
    const bool wraps = layer.raster->description().wraps;
    if (!shown.middle || !wraps) shown.middle = source::middle_of(*layer.raster);
    if (wraps) continue;
    auto footprint = source::open_footprint(layer.raster, shown.world.ellipsoid);
    if (!footprint) return footprint.error();
    LayerSpec spec;
    spec.name = "footprint of " + layer.spec.name;
    spec.group = LayerGroup::overlay;
    spec.source.raster = std::move(*footprint);
    shown.world.layers.push_back(std::move(spec));
  }
  return shown;
}

}  // namespace tellurion::globe
