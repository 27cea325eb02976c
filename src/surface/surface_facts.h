// What is known of a surface tile before anything of it is loaded: a pure function of its key.
#pragma once

#include <optional>

#include "geo/tile_key.h"
#include "surface/height_error.h"

namespace tellurion::surface {

struct TileFacts {
  float min_height = 0;               ///< bounds of the heights under the tile, metres above the ellipsoid
  float max_height = 0;
  std::optional<HeightError> height_error;  ///< of the tile's own height grid, at least that of every descendant.
                                            ///< Nothing: known once it is built
  bool assumed = false;               ///< heights and error above are what any terrain could have: built tiles know better,
                                      ///< of themselves and of their descendants (Outlook)
  bool own_colour = false;            ///< some imagery under it has samples smaller than two of its parent's texels: it gets a slot of its own
  bool own_effects = false;           ///< and another one, for night and water
  bool own_overlay = false;           ///< and one for what lies over the light
  bool own_normals = false;           ///< and one for normals
  bool finer_colour_below = false;    ///< the same of its own texels
  bool own_slopes = false;            ///< elevation under it is finer than its parent's slope texels
};

/// Thread-safe, immutable; replaced as a whole when data sets or error tables change.
class SurfaceFacts {
 public:
  virtual ~SurfaceFacts() = default;
  virtual TileFacts facts_of(const geo::TileKey& key) const = 0;
};

}  // namespace tellurion::surface
