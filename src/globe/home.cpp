// Where a view of a globe begins.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>

#include "globe/globe.h"
#include "source/catalogue/catalogue.h"

namespace tellurion::globe {
namespace {

/// A part of the globe that a view may begin over.
struct Region {
  geo::LatLon middle;
  double tall = 0, wide = 0;   ///< metres
  Metres spacing{0};
};

constexpr double kRegional = 1.0;  ///< radians from south to north, at most

/// Nothing if the raster shows much of the body.
std::optional<Region> region_of(const source::RasterDescription& raster, double a) {
  const auto& b = raster.bounds;
  if (b.north.value - b.south.value >= kRegional) return std::nullopt;
  const double latitude = 0.5 * (b.south.value + b.north.value);
  const double tall = (b.north.value - b.south.value) * a;
  constexpr double kPole = std::numbers::pi / 2, kNearly = 1e-3;
  if (b.east.value - b.west.value > 2.0 * std::numbers::pi - kNearly && std::max(b.north.value, -b.south.value) > kPole - kNearly)
    return Region{{Radians(std::copysign(kPole, latitude)), Radians(0)}, 2.0 * tall, 2.0 * tall, raster.spacing};  // all round a pole
  const double wide = std::min((b.east.value - b.west.value) * std::cos(latitude), kPole) * a;
  return Region{{Radians(latitude), Radians(0.5 * (b.west.value + b.east.value))}, tall, wide, raster.spacing};
}

/// The same of what is known of a catalogue.
std::optional<Region> region_of(const source::Catalogue& catalogue, double a) {
  glm::dvec3 sum(0.0);
  Metres spacing(std::numeric_limits<double>::infinity());
  for (const auto& set : catalogue.sets()) {
    sum += set->footprint.cap().middle;
    spacing = std::min(spacing, set->footprint.spacing());
  }
  if (glm::length(sum) < 1e-3) return std::nullopt;
  const glm::dvec3 middle = glm::normalize(sum);
  double radius = 0;
  for (const auto& set : catalogue.sets()) {
    const source::SphereCap& cap = set->footprint.cap();
    radius = std::max(radius, std::acos(std::clamp(glm::dot(middle, cap.middle), -1.0, 1.0)) + std::acos(std::clamp(cap.cosine, -1.0, 1.0)));
  }
  if (2.0 * radius >= kRegional) return std::nullopt;
  return Region{geo::place_of_normal(geo::Vector<geo::Ecef>{middle}), 2.0 * radius * a, 2.0 * radius * a, spacing};
}

}  // namespace

view::Pose Globe::home() const { return home_of(layer_order()); }
view::Pose Globe::home(std::size_t layer) const { return home_of({layer}); }

view::Pose Globe::home_of(const std::vector<std::size_t>& layers) const {
  const double a = ellipsoid().a();
  view::Pose pose;
  std::optional<Region> finest;
  for (const std::size_t i : layers) {
    const auto catalogue = catalogue_of(i);
    const auto raster = shown_raster(i);
    const auto region = raster ? region_of(raster->description(), a) : catalogue ? region_of(*catalogue, a) : std::nullopt;
    if (region && (!finest || region->spacing < finest->spacing)) finest = region;
  }
  if (!finest) {
    pose.position = {to_radians(Degrees(20.0)), to_radians(Degrees(10.0)), EllipsoidalHeight(2.2 * a)};
    return pose;
  }
  // The default view is 45 degrees high and a good deal wider; a tenth of room all round.
  const double height = 1.2 * std::max(finest->tall, finest->wide / 1.5) / (2.0 * std::tan(to_radians(Degrees(22.5)).value));
  pose.position = {finest->middle.latitude, finest->middle.longitude, EllipsoidalHeight(std::max(height, 100.0))};
  if (auto sampler = height_sampler()) {
    if (const auto ground = sampler->height_at(geo::place_of(pose.position))) pose.position.height.value += std::max(ground->height.value, 0.0);
  }
  return pose;
}

}  // namespace tellurion::globe
