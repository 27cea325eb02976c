// The samples of a raster that lie under a tile.
// Worker side: uses one thread's reader.
#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "geo/tile_key.h"
#include "source/raster_source.h"

namespace tellurion::surface {

/// A sample's own place, on the globe and in its tile.
struct TileSample {
  geo::LatLon place;
  glm::dvec2 st{0.0};  ///< tile coordinates in [0, 1]^2
};

/// Pixels of level 0 whose samples can lie within the tile, a few more round it; with `wraps`, columns may run past the raster's width.
/// Wholly conservative; of no width where nothing touches.
source::PixelWindow window_under(source::RasterReader& reader, const source::RasterDescription& about, const geo::TileKey& key);

/// Where the sample of a column or row of `size` lies, in pixels; the two before the first and the two after the last stand for
/// the raster's border and the end of the slope beyond it, where the surface has its other creases.
double sample_place(int i, int size);

/// Adds those to a window that reaches an end of the raster.
void include_border(source::PixelWindow& window, const source::RasterDescription& about);

/// All samples of level 0 within the tile, and the places that stand for the raster's border. For tiles whose grid is about as fine as the samples or finer: there are few.
std::vector<TileSample> samples_under(source::RasterReader& reader, const source::RasterDescription& about, const geo::TileKey& key);

}  // namespace tellurion::surface
