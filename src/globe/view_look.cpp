#include "globe/view_look.h"

#include <cmath>
#include <cstddef>
#include <optional>

#include "geo/sun.h"

namespace tellurion::globe {
namespace {

constexpr std::size_t kMostTiles = 20000;  ///< of a picture

/// Direction to the light for a camera: the sun at `time`, or without a time the map-maker's light: from the north-west,
/// 45 degrees high, at the place under the eye.
geo::Vector<geo::Ecef> light_direction(const World& world, const view::Camera& camera, const std::optional<UtcTime>& time) {
  if (time) {
    if (const auto sun = geo::direction_to_sun(world.planet, *time)) return *sun;
  }
  const geo::Geodetic below = geo::to_geodetic(world.ellipsoid, camera.eye);
  const auto enu = geo::enu_at(world.ellipsoid, below);
  return enu(geo::Vector<geo::Enu>{{-0.5, 0.5, std::sqrt(0.5)}});
}

}  // namespace

render::FrameLook look_of(const ViewSettings& settings, const World& world, const view::Camera& camera) {
  render::FrameLook look;
  look.exaggeration = settings.exaggeration;
  look.lighting = settings.lighting;
  look.atmosphere = settings.atmosphere && world.planet == "Earth";
  look.wireframe = settings.wireframe;
  look.bounds = settings.bounds;
  look.tile_borders = settings.tile_borders;
  look.antialiasing = settings.antialiasing;
  look.anisotropy = settings.anisotropy;
  look.clear = settings.clear;
  look.to_sun = light_direction(world, camera, settings.time);
  return look;
}

surface::SelectionSettings selection_of(const ViewSettings& settings, std::size_t max_bytes) {
  surface::SelectionSettings selection;
  selection.sse_px = settings.sse_px;
  selection.exaggeration = settings.exaggeration;
  selection.metric = settings.lod;
  selection.anisotropy = settings.anisotropy;
  selection.max_tiles = kMostTiles;
  selection.max_bytes = max_bytes;
  selection.transitions = settings.transitions;
  selection.frozen = settings.frozen;
  return selection;
}

}  // namespace tellurion::globe
