#include "globe/layer_facts.h"

#include <algorithm>
#include <utility>

#include <glm/geometric.hpp>

#include "geo/ellipsoid.h"
#include "source/catalogue/catalogue.h"
#include "source/debug/footprint.h"

namespace tellurion::globe {
namespace {

/// Of all its rasters; that of the first one where they lie all round the globe.
geo::LatLon middle_of(const source::Catalogue& catalogue) {
  glm::dvec3 sum(0.0);
  for (const auto& set : catalogue.sets()) sum += set->footprint.cap().middle;
  if (glm::length(sum) < 0.1 * static_cast<double>(catalogue.sets().size())) sum = catalogue.sets().front()->footprint.cap().middle;
  return geo::place_of_normal({glm::normalize(sum)});
}

}  // namespace

Result<source::RasterStatistics> statistics_of(const LayerInfo& layer, double most_samples) { return source::statistics_of(*layer.raster, most_samples); }

std::optional<CatalogueFacts> catalogue_facts(const Globe& globe, std::size_t layer) {
  const auto catalogue = globe.catalogue_of(layer);
  if (!catalogue) return std::nullopt;
  CatalogueFacts facts;
  facts.rasters = catalogue->sets().size();
  facts.to_look_into = globe.rasters_to_look_into(layer);
  if (facts.rasters > 0) {
    const auto [finest, coarsest] = std::ranges::minmax(catalogue->sets(), {}, [](const auto& set) { return set->footprint.spacing(); });
    facts.finest = finest->footprint.spacing();
    facts.coarsest = coarsest->footprint.spacing();
  }
  return facts;
}

Result<ShownFootprints> with_footprints(World world, const Globe& told) {
  ShownFootprints shown{std::move(world), {}};
  for (std::size_t i = 0; i < told.layer_count(); ++i) {
    const LayerInfo& layer = told.layer(i);
    const auto catalogue = told.catalogue_of(i);
    Result<std::unique_ptr<source::RasterSource>> footprint(nullptr);
    if (layer.raster) {
      const bool wraps = layer.raster->description().wraps;
      if (!shown.middle || !wraps) shown.middle = source::middle_of(*layer.raster);
      if (!wraps) footprint = source::open_footprint(layer.raster, shown.world.ellipsoid);
    } else if (catalogue && !catalogue->sets().empty()) {
      shown.middle = middle_of(*catalogue);
      footprint = source::open_footprints(catalogue, layer.spec.name, shown.world.ellipsoid);
    }
    if (!footprint) return footprint.error();
    if (!*footprint) continue;
    LayerSpec spec;
    spec.name = "footprint of " + layer.spec.name;
    spec.group = LayerGroup::overlay;
    spec.source.raster = std::move(*footprint);
    shown.world.layers.push_back(std::move(spec));
  }
  return shown;
}

}  // namespace tellurion::globe
