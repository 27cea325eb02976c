// What a user may want to know of layers: what their samples are like, and where on the globe they lie.
#pragma once

#include <cstddef>
#include <optional>

#include "base/result.h"
#include "geo/geodetic.h"
#include "globe/globe.h"
#include "source/statistics.h"

namespace tellurion::globe {

/// See source::statistics_of. Of a layer that has a raster.
Result<source::RasterStatistics> statistics_of(const LayerInfo& layer, double most_samples);

/// Of a layer of many rasters.
struct CatalogueFacts {
  std::size_t rasters = 0;       ///< known so far
  std::size_t to_look_into = 0;  ///< whose place is not known yet
  Metres finest{0};              ///< distances between the samples of the finest and the coarsest one; 0 if there is none
  Metres coarsest{0};
};
/// Nothing if the layer is none.
std::optional<CatalogueFacts> catalogue_facts(const Globe& globe, std::size_t layer);

/// A world that also shows where layers lie.
struct ShownFootprints {
  World world;
  std::optional<geo::LatLon> middle;  ///< of the last raster that does not go round the globe or the last catalogue, or of any
};

/// Adds an overlay for each layer of `told`, but for rasters that go round the globe.
Result<ShownFootprints> with_footprints(World world, const Globe& told);

}  // namespace tellurion::globe
