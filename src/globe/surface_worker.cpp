#include "globe/surface_worker.h"

#include <utility>

#include "surface/tile_builder.h"

namespace tellurion::globe {

Result<surface::ElevationModel*> SurfaceWorker::elevation(std::shared_ptr<const surface::SurfaceDescription> surface) {
  if (!elevation_ || elevation_->description().heights != surface->heights) {
    elevation_.reset();
    auto opened = surface::ElevationModel::open(std::move(surface), cache_);
    if (!opened) return opened.error();
    elevation_.emplace(std::move(*opened));
  }
  return &*elevation_;
}

Result<surface::ColourModel*> SurfaceWorker::colours(std::shared_ptr<const surface::SurfaceDescription> surface) {
  if (!colours_ || colours_->description().colours != surface->colours) {
    auto opened = surface::ColourModel::open(std::move(surface), cache_, colours_ ? &*colours_ : nullptr);
    colours_.reset();
    if (!opened) return opened.error();
    colours_.emplace(std::move(*opened));
  }
  return &*colours_;
}

Result<surface::TileGeometry> SurfaceWorker::build_geometry(std::shared_ptr<const surface::SurfaceDescription> surface,
                                                            const surface::SurfaceFacts& facts, const geo::TileKey& key, std::stop_token stop) {
  const auto model = elevation(std::move(surface));
  if (!model) return model.error();
  std::vector<surface::MissingLayer> missing;
  (*model)->go_without(&missing);
  auto geometry = surface::build_geometry(**model, facts, key, {}, stop);
  (*model)->go_without(nullptr);
  if ((*model)->take_pending(awaited_)) return Error{ErrorCode::pending, "geometry of " + geo::to_string(key)};
  if (geometry) geometry->missing = std::move(missing);
  return geometry;
}

Result<surface::TileImagery> SurfaceWorker::build_colour(std::shared_ptr<const surface::SurfaceDescription> surface,
                                                         const geo::TileKey& key, std::stop_token stop) {
  const auto model = colours(std::move(surface));
  if (!model) return model.error();
  auto imagery = surface::build_imagery(**model, key, stop);
  if ((*model)->take_pending(awaited_)) return Error{ErrorCode::pending, "imagery of " + geo::to_string(key)};
  return imagery;
}

}  // namespace tellurion::globe
