// Where the surface of a tile can be, and whether a view can see any of it.
// Thread-safe: pure functions. Double precision throughout; heights are as displayed (exaggeration included).
#pragma once

#include <array>
#include <optional>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "geo/ellipsoid.h"
#include "geo/tile_key.h"
#include "view/camera.h"

namespace tellurion::surface {

/// What a tile is at height 0, measured on the ellipsoid.
struct TileShape {
  glm::dvec3 up{0.0};            ///< unit normal at the centre
  double size = 0;               ///< length of the tile along the direction in which it is longest stretched, metres
  double grid_diagonal = 0;      ///< longer diagonal of a cell of its height grid (kGridSide), metres
  double cone = 0;               ///< largest angle between `up` and a normal of the tile, radians
};
TileShape tile_shape(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key);

/// A box that need not be parallel to the frame's axes.
struct OrientedBox {
  glm::dvec3 centre{0.0};        ///< Ecef
  glm::dmat3 axes{1.0};          ///< columns: unit vectors; the last is the tile's centre normal
  glm::dvec3 half{0.0};          ///< half lengths along the axes, metres
};

/// Encloses every point of the curved tile between the heights `lowest` and `highest`, metres above the ellipsoid.
/// A wider range of heights never gives a smaller box.
OrientedBox tile_box(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key, double lowest, double highest);

/// From `point` to the nearest point of the box; 0 inside.
double distance_to(const OrientedBox& box, const glm::dvec3& point);

/// The part of space that a camera sees: the four sides of its frustum and the plane of the eye, as planes through the eye.
struct ViewVolume {
  glm::dvec3 eye{0.0};
  std::array<glm::dvec3, 5> inward{};   ///< unit normals
};
ViewVolume make_view_volume(const view::Camera& camera);

/// A set of planes of a ViewVolume, a bit each.
using PlaneSet = unsigned;
inline constexpr PlaneSet kAllPlanes = 0b11111;

/// Nothing if the box lies outside one of `planes`; else those of them which it crosses. What lies in the box needs no test
/// against the others. May keep a box that lies just outside an edge of the volume, never drops one that is partly inside.
std::optional<PlaneSet> planes_crossed(const ViewVolume& volume, const OrientedBox& box, PlaneSet planes);

/// What the body itself hides from an eye. The occluder is the ellipsoid shrunk about its centre until no point of it is
/// nearer to the surface than the lowest terrain: a body that lies wholly within the solid ground. Where it casts its shadow
/// nothing can be seen. From an eye inside the occluder nothing is held hidden.
class Horizon {
 public:
  /// `lowest`: height of the lowest terrain of the body as displayed; values above 0 count as 0.
  Horizon(const geo::Ellipsoid& ellipsoid, const glm::dvec3& eye, double lowest);

  /// True only if no point of the box can be seen. Exact for the box: its shadow is convex, so the corners decide.
  bool hides(const OrientedBox& box) const;

 private:
  bool hides(const glm::dvec3& from_eye) const;

  glm::dvec3 scale_{0.0};      ///< Ecef to the space where the occluder is the unit sphere
  glm::dvec3 eye_{0.0};        ///< in that space
  double tangent_squared_ = 0; ///< squared length of a tangent from the eye to the unit sphere; 0 or less: nothing is hidden
};

}  // namespace tellurion::surface
