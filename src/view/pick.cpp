#include "view/pick.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace tellurion::view {
namespace {

double clearance_at(const Ground& ground, const geo::Point<geo::Ecef>& point) {
  const geo::Geodetic place = geo::to_geodetic(ground.ellipsoid, point);
  const double height = ground.heights != nullptr ? ground.heights->height_at(geo::place_of(place)).value : 0.0;
  return place.height.value - height;
}

}  // namespace

double clearance_of(const Ground& ground, const Camera& camera) { return clearance_at(ground, camera.eye); }

std::optional<geo::Point<geo::Ecef>> pick(const Ground& ground, const Camera& camera, glm::dvec2 pixel) {
  const geo::Vector<geo::Ecef> ray = camera.ray(pixel);
  if (ground.heights == nullptr) {
    const double t = geo::intersect_ray(ground.ellipsoid, Metres(0.0), camera.eye, ray);
    if (t < 0.0) return std::nullopt;
    return camera.eye + ray * t;
  }
  // Walks along the ray, half the clearance at a time (safe for slopes of up to 60 degrees), then bisects.
  constexpr int kMostSteps = 2000;
  constexpr double kFinestStep = 1e-4;  // of the way so far: well below a pixel
  const double highest = 0.05 * ground.ellipsoid.a();
  double above = 0.0;
  double t = 0.0;
  double clearance = clearance_at(ground, camera.eye);
  if (clearance <= 0.0) return std::nullopt;
  for (int step = 0; clearance > 0.0; ++step) {
    const bool climbs = glm::dot((camera.eye + ray * t).xyz, ray.xyz) > 0.0;
    if ((climbs && clearance > highest) || step == kMostSteps) return std::nullopt;
    above = t;
    t += std::max({0.5 * clearance, kFinestStep * t, 1e-3});
    clearance = clearance_at(ground, camera.eye + ray * t);
  }
  while (t - above > 1e-9 * t) {
    const double middle = 0.5 * (above + t);
    (clearance_at(ground, camera.eye + ray * middle) > 0.0 ? above : t) = middle;
  }
  return camera.eye + ray * t;
}

}  // namespace tellurion::view
