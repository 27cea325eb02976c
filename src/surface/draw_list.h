// What the surface asks the renderer to draw in a frame.
#pragma once

#include <cstdint>
#include <vector>

#include "geo/tile_key.h"

namespace tellurion::surface {

/// One tile of the drawn cut. Its mesh is resident; the slots named are resident too.
struct DrawTile {
  geo::TileKey key;
  geo::TileKey colour_owner;         ///< the tile itself or the ancestor whose colour slot it shows
  geo::TileKey colour_before;        ///< the slot it is fading from; equal to colour_owner when it is not
  geo::TileKey slope_owner;          ///< likewise for slopes
  float fade = 1.0f;                 ///< share of colour_owner over colour_before
  float morph = 1.0f;                ///< share of the own height over the parent's
  float skirt_depth = 0.0f;          ///< metres, exaggeration included
  float error_px = 0.0f;             ///< what the cut thinks of it
  double distance = 0.0;             ///< metres, of the nearest point of its bounds
  std::uint8_t step = 0;             ///< of its mesh
  /// A coarse tile that stands in may lie above the eye. What of it is higher than `sink_level` (metres above the ellipsoid,
  /// exaggeration included) is drawn as much lower as it takes, but at most by `sink_depth`.
  float sink_depth = 0.0f;
  float sink_level = 0.0f;
};

}  // namespace tellurion::surface
