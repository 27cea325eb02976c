// Parts of tiles whose data are on their way.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>

#include "geo/tile_key.h"
#include "globe/surface_worker.h"
#include "surface/tile_tree.h"

namespace tellurion::globe {

/// A part that is built once its data have come. Who drops it lets go of the data.
struct WaitingPart {
  geo::TileKey key;
  surface::Part part = surface::Part::geometry;
  source::Awaited awaited;
  std::shared_ptr<std::atomic<std::size_t>> missing;
};

WaitingPart waiting_part(const geo::TileKey& key, surface::Part part, source::Awaited awaited);

/// Screen error gained per byte, for what a part waits for. Files of which nothing is known count as 16 KB.
double gain_of(const WaitingPart& part, double gain_px);

}  // namespace tellurion::globe
