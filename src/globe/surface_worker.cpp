#include "globe/surface_worker.h"

#include <utility>

#include "surface/tile_builder.h"

namespace tellurion::globe {
namespace {

/// `model`, opened anew if it belongs to another description.
template <class Model>
Result<Model*> model_of(std::optional<Model>& model, std::shared_ptr<const surface::SurfaceDescription> surface,
                        cache::BlockCache& cache) {
  if (!model || model->description().revision != surface->revision) {
    model.reset();
    auto opened = Model::open(std::move(surface), cache);
    if (!opened) return opened.error();
    model.emplace(std::move(*opened));
  }
  return &*model;
}

}  // namespace

Result<surface::ElevationModel*> SurfaceWorker::elevation(std::shared_ptr<const surface::SurfaceDescription> surface) {
  return model_of(elevation_, std::move(surface), cache_);
}

Result<surface::TileGeometry> SurfaceWorker::build_geometry(std::shared_ptr<const surface::SurfaceDescription> surface,
                                                            const surface::SurfaceFacts& facts, const geo::TileKey& key, std::stop_token stop) {
  const auto model = elevation(std::move(surface));
  if (!model) return model.error();
  auto geometry = surface::build_geometry(**model, facts, key, {}, stop);
  if ((*model)->take_pending(awaited_)) return Error{ErrorCode::pending, "geometry of " + geo::to_string(key)};
  return geometry;
}

Result<surface::TileImagery> SurfaceWorker::build_colour(std::shared_ptr<const surface::SurfaceDescription> surface,
                                                         const geo::TileKey& key, std::stop_token stop) {
  const auto model = model_of(colours_, std::move(surface), cache_);
  if (!model) return model.error();
  auto imagery = surface::build_imagery(**model, key, stop);
  if ((*model)->take_pending(awaited_)) return Error{ErrorCode::pending, "imagery of " + geo::to_string(key)};
  return imagery;
}

}  // namespace tellurion::globe
