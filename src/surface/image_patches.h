// Pieces of imagery for a tile's colour slot: windows of the sources and where each of their pixels lies in the slot.
// A job of a worker: values and a stop token in, a result out.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <stop_token>
#include <utility>
#include <vector>

#include "base/result.h"
#include "cache/cached_raster.h"
#include "surface/elevation_model.h"
#include "surface/tile_content.h"

namespace tellurion::surface {

/// The enabled colour layers as one worker reads them, lowest first. Belongs to one thread.
class ColourModel {
 public:
  /// `before`: a model of the same thread that is not needed any more; rasters that both show stay open.
  static Result<ColourModel> open(std::shared_ptr<const SurfaceDescription> description, cache::BlockCache& cache, ColourModel* before = nullptr);

  const SurfaceDescription& description() const { return *description_; }

  /// Whether a build since the last call met pixels that are on their way (it answered `pending`), and what brings them.
  bool take_pending(source::Awaited& awaited);

 private:
  friend Result<TileImagery> build_imagery(ColourModel&, const geo::TileKey&, std::stop_token);

  /// An open raster: a layer's, or one of a catalogue.
  struct OpenRaster {
    std::uint32_t id;
    std::shared_ptr<const source::RasterSource> source;
    cache::CachedRaster raster;
  };
  struct ColourLayer {
    const Layer* settings;
    std::list<OpenRaster> rasters;   ///< that of its source, or the open ones of its catalogue, the last used first
  };

  ColourModel() = default;
  /// The open rasters of the layer, taken out; none if it is not there.
  std::list<OpenRaster> take_rasters(const Layer& layer);
  /// Errors: those of opening.
  Result<cache::CachedRaster*> open_data_set(ColourLayer& layer, std::uint32_t index);

  std::shared_ptr<const SurfaceDescription> description_;
  cache::BlockCache* cache_ = nullptr;
  std::vector<ColourLayer> layers_;
};

/// The patches of all layers that touch the tile, lowest first; layers wholly hidden by opaque ones above are left out.
/// Between control points places err by less than a third of a texel; round a pole of the source, where none could do that, the
/// slot's own texels are sampled here. Windows have about one to two pixels a texel on either axis, at most kLargestWindow on a side.
/// Errors: those of reading, cancelled; pending, once all that is wanted has been asked for.
Result<TileImagery> build_imagery(ColourModel& model, const geo::TileKey& key, std::stop_token stop = {});

inline constexpr int kLargestWindow = 1024;  ///< pixels

}  // namespace tellurion::surface
