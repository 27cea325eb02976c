// How wrong a tile looks, in pixels.
// Thread-safe: pure functions.
//
// Pixels are those of the middle of the picture: at an angle q off the axis a pixel subtends between cos q and cos^2 q of
// that, so the measure does not depend on where the camera looks (an eye may serve several pictures), and a picture's
// corner at 45 degrees of vertical view shows up to 1.7 times the error in its own pixels.
#pragma once

#include <glm/vec3.hpp>

#include "surface/tile_bounds.h"
#include "surface/tile_content.h"
#include "surface/tile_tree.h"

namespace tellurion::surface {

/// Nearer than this nothing is measured: an eye inside a tile's bounds would see infinite errors.
inline constexpr double kNearestDistance = 0.1;  // metres

/// All of a view that the errors depend on.
struct ErrorView {
  glm::dvec3 eye{0.0};
  double pixel_angle = 0;
  double exaggeration = 1;
  double anisotropy = 1;
  double body_radius = 0;   ///< equatorial radius, metres
};

/// Size of `metres` at `distance`, in pixels.
inline double to_pixels(const ErrorView& view, double metres, double distance) {
  return metres / ((distance > kNearestDistance ? distance : kNearestDistance) * view.pixel_angle);
}

/// Deviation of a tile from the truth as displayed, metres.
struct DisplayedError {
  double judged = 0;  ///< see judged(HeightError)
  double bound = 0;   ///< nowhere more
};

/// The height's deviation grows with the exaggeration; the chord's under the body's curvature grows with the radius at which
/// the displaced surface lies.
DisplayedError displayed_error(const ErrorView& view, const MeshError& error, double max_height);

/// The part of the error that comes from the body's curvature when all samples of the height grid are drawn: the sag of the
/// longest diagonal, at the smallest radius of curvature.
float full_grid_curvature_error(const geo::Ellipsoid& ellipsoid, const TileShape& shape);

/// Float vertices err by up to 1e-7 of the tile's size; that has to stay below a quarter of the wanted error.
double precision_metres(const TileShape& shape);

/// Length of a texel of the tile's colour slot on the ground, metres, along its larger axis.
double texel_metres(const TileShape& shape);

/// min(1, A sin g): how much of a texel's length the filter can show. g is the steepest angle between view and surface, over
/// the directions from the tile's box to the eye and a cone of normals: the tile's own, widened by the slope that its relief
/// (as displayed, metres) has when it is climbed within a half of the tile.
double visible_share(const ErrorView& view, const TileShape& shape, const OrientedBox& box, double relief);

/// LodMetric::distance: a tile is split nearer than this many of its sizes. Chosen so that a texel of a tile at the limit
/// measures `sse_px` when seen from above: 1 / (texels * pixel_angle * sse_px).
double split_distance_in_sizes(const ErrorView& view, double sse_px);

/// LodMetric::solid_angle: a tile is split when it covers more than this, measured as size^2 * share / distance^2. Chosen so
/// that at the limit every texel of its slot covers sse_px^2 pixels: (texels * pixel_angle * sse_px)^2.
double split_solid_angle(const ErrorView& view, double sse_px);

}  // namespace tellurion::surface
