#include "render/frame_block.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace tellurion::render {
namespace {

using glm::dvec3;

/// The sky mesh begins this far below the ellipsoid's horizon: valleys below the ellipsoid see there, in radii; and the planet's
/// drawn outline lies within the true one, in pixels.
constexpr double kSkyDip = 0.002;
constexpr double kSkyDipPixels = 2.5;

glm::dmat4 projection(const view::Camera& camera, bool reversed) {
  const double f = 1.0 / std::tan(camera.vertical_fov.value / 2);
  glm::dmat4 p(0.0);
  p[0][0] = f * camera.height / camera.width;
  p[1][1] = f;
  p[2][3] = -1.0;
  if (reversed) {
    p[3][2] = kNearM;
  } else {
    p[2][2] = -1.0;
    p[3][2] = -2.0 * kNearM;
  }
  return p;
}

/// Pictures from space are exposed for the bright disc, those from the ground for the sky: share of the air's brightness.
double exposure(double height_m) {
  const double t = std::clamp((height_m - 2e3) / 80e3, 0.0, 1.0);
  return 1.0 - 0.6 * t * t * (3.0 - 2.0 * t);
}

/// Angle of the rays from `distance` that touch a sphere of `radius`, above the horizontal.
double tangent_angle(double radius, double distance) { return -std::acos(std::min(radius / distance, 1.0)); }

void add_air(FrameBlock& block, const view::Camera& camera, const FrameLook& look, const geo::Ellipsoid& ellipsoid,
             const Air& air) {
  const dvec3 scale = 1.0 / dvec3(ellipsoid.a(), ellipsoid.a(), ellipsoid.b());
  const dvec3 eye = camera.eye.xyz * scale;
  const double distance = std::max(glm::length(eye), 1e-6);
  const dvec3 up = eye / distance;
  const dvec3 across = std::hypot(up.x, up.y) > 1e-6 ? dvec3(-up.y, up.x, 0.0) : dvec3(0.0, 1.0, 0.0);
  const dvec3 east = glm::normalize(across);
  const double top = 1.0 + air.top_m / ellipsoid.a();
  const double lowest = tangent_angle(1.0 - kSkyDip, distance) - kSkyDipPixels * camera.pixel_angle();
  const double highest = distance < top ? std::numbers::pi / 2 : tangent_angle(top, distance);
  // Without shading it is noon wherever the eye is.
  const dvec3 sun = look.lighting ? glm::normalize(look.to_sun.xyz * scale) : up;

  block.air_sun = glm::vec4(sun, air.brightness * exposure((distance - 1.0) * ellipsoid.a()));
  block.air_eye = glm::vec4(eye, 0.0);
  block.air_scale = glm::vec4(scale, air.scale_height_m / ellipsoid.a());
  block.air_scatter = glm::vec4(air.scattering_per_m * ellipsoid.a(), air.haze_per_m * ellipsoid.a());
  block.air_extinction = glm::vec4((air.scattering_per_m + air.haze_per_m + air.absorption_per_m) * ellipsoid.a(), 0.0);
  block.sky_east = glm::vec4(east, lowest);
  block.sky_north = glm::vec4(glm::cross(up, east), highest);
  block.sky_up = glm::vec4(up, top);
}

}  // namespace

FrameBlock make_frame_block(const view::Camera& camera, const FrameLook& look, const RendererOptions& options, bool reversed) {
  FrameBlock block{};
  block.clip_from_relative = glm::mat4(projection(camera, reversed) * glm::dmat4(glm::transpose(camera.axes)));
  block.sun = glm::vec4(look.to_sun.xyz, look.exaggeration);
  block.clear_colour = glm::vec4(look.clear, 1.0f);
  if (options.air) add_air(block, camera, look, options.ellipsoid, *options.air);
  return block;
}

}  // namespace tellurion::render
