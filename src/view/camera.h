// Where the eye is, where it looks, and what a pixel sees.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <string_view>

#include "base/quantity.h"
#include "base/result.h"
#include "geo/ellipsoid.h"
#include "geo/frames.h"

namespace tellurion::view {

/// A camera as users say it: `lat,lon,height[,heading[,pitch[,roll]]]`.
struct Pose {
  geo::Geodetic position;
  Radians heading{0.0};                ///< clockwise from north
  Radians pitch{-1.5707963267948966};  ///< from the horizon, up positive; straight down by default
  Radians roll{0.0};                   ///< clockwise as the pilot sees it (right side down)
};

/// Reads `lat,lon,height[,heading[,pitch[,roll]]]` in degrees and metres. Errors: invalid_argument, naming the text.
Result<Pose> parse_pose(std::string_view text);

/// A perspective view. Camera axes: x right, y up, z towards the viewer (looks along -z).
struct Camera {
  geo::Point<geo::Ecef> eye;
  glm::dmat3 axes{1.0};  ///< columns: right, up, back, as unit vectors in ECEF
  Radians vertical_fov{0.7853981633974483};
  int width = 1280;  ///< pixels
  int height = 720;

  geo::Vector<geo::Ecef> forward() const { return {-axes[2]}; }
  /// Size of a pixel at distance 1 (in the middle of the picture).
  double pixel_angle() const;
  /// Unit direction through the picture at `pixel` (continuous; pixel (0, 0) covers [0,1) x [0,1), row 0 on top).
  geo::Vector<geo::Ecef> ray(glm::dvec2 pixel) const;
};

/// The camera axes of `pose` in ECEF (see Camera::axes); heights and ellipsoids do not matter.
glm::dmat3 axes_of(const Pose& pose);
/// The pose of a camera with these axes in this place.
Pose pose_with_axes(const geo::Geodetic& position, const glm::dmat3& axes);

Camera make_camera(const geo::Ellipsoid& ellipsoid, const Pose& pose, Radians vertical_fov, int width, int height);
/// The reverse of make_camera. At a pole, heading counts from the meridian of the position's longitude.
Pose pose_of(const geo::Ellipsoid& ellipsoid, const Camera& camera);

/// Four side planes of the view, camera-relative: a point p is inside where dot(normal, p - eye) >= 0.
struct Frustum {
  glm::dvec3 inward[4];  ///< left, right, bottom, top; unit normals in ECEF axes through the eye
  glm::dvec3 forward;
};
Frustum make_frustum(const Camera& camera);

}  // namespace tellurion::view
