// What one worker holds: its own readers of all layers, opened when first needed and again when the layers change.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include "base/result.h"
#include "cache/block_cache.h"
#include "surface/elevation_model.h"
#include "surface/image_patches.h"
#include "surface/surface_facts.h"
#include "surface/tile_content.h"

namespace tellurion::globe {

/// Belongs to one thread at a time.
class SurfaceWorker {
 public:
  /// `cache` outlives the worker.
  explicit SurfaceWorker(cache::BlockCache& cache) : cache_(cache) {}

  Result<surface::TileGeometry> build_geometry(std::shared_ptr<const surface::SurfaceDescription> surface,
                                               const surface::SurfaceFacts& facts, const geo::TileKey& key, std::stop_token stop);
  Result<surface::TileImagery> build_colour(std::shared_ptr<const surface::SurfaceDescription> surface, const geo::TileKey& key,
                                            std::stop_token stop);
  /// What the last build that answered `pending` waits for. Empty: another build has asked for it; it comes with that.
  source::Awaited take_awaited() { return std::exchange(awaited_, {}); }
  /// The readers of the height layers, for other questions.
  Result<surface::ElevationModel*> elevation(std::shared_ptr<const surface::SurfaceDescription> surface);

 private:
  Result<surface::ColourModel*> colours(std::shared_ptr<const surface::SurfaceDescription> surface);

  cache::BlockCache& cache_;
  std::optional<surface::ElevationModel> elevation_;
  std::optional<surface::ColourModel> colours_;
  source::Awaited awaited_;
};

}  // namespace tellurion::globe
