#include "surface/elevation_model.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace tellurion::surface {
namespace {

constexpr double kPi = std::numbers::pi;

/// The raster's bounds and the pixel round them across which its coverage falls to 0, with a pixel to spare.
geo::GeodeticBounds reach_of(const source::RasterDescription& raster) {
  const double margin = 2.0 * raster.spacing.value / raster.ellipsoid.b();
  geo::GeodeticBounds reach = raster.bounds;
  reach.south.value -= margin;
  reach.north.value += margin;
  const double widest_latitude = std::max(std::abs(reach.south.value), std::abs(reach.north.value));
  const double cosine = std::cos(std::min(widest_latitude, kPi / 2));
  const double sideways = cosine > margin ? margin / cosine : kPi;
  reach.west.value -= sideways;
  reach.east.value += sideways;
  return reach;
}

bool holds(const geo::GeodeticBounds& bounds, const geo::LatLon& place) {
  if (place.latitude < bounds.south || place.latitude > bounds.north) return false;
  double east_of_west = std::fmod(place.longitude.value - bounds.west.value, 2.0 * kPi);
  if (east_of_west < 0.0) east_of_west += 2.0 * kPi;
  return east_of_west <= bounds.east.value - bounds.west.value;
}

double spacing_of_level(const source::RasterDescription& raster, int level) {
  return std::ldexp(raster.spacing.value, level);
}

void compose_one(double& below, const cache::HeightSample& sample, bool adds) {
  below += sample.coverage * (adds ? sample.metres : sample.metres - below);
}

bool is_finite(const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// The place within the raster nearest to a pixel, and the share of the raster's coverage that is left there.
struct WithinRaster {
  glm::dvec2 pixel;
  double reach = 1.0;
};
WithinRaster bring_within(const source::RasterDescription& raster, int level, const glm::dvec2& pixel) {
  const source::LevelSize& full = raster.levels.front();
  glm::dvec2 nearest = glm::clamp(pixel, glm::dvec2(0.0), glm::dvec2(full.width, full.height));
  if (raster.wraps) nearest.x = pixel.x;
  const glm::dvec2 beyond = glm::abs(pixel - nearest) * source::level_scale(raster, level);
  return {nearest, std::max(0.0, 1.0 - beyond.x) * std::max(0.0, 1.0 - beyond.y)};
}

}  // namespace

int level_for_spacing(const source::RasterDescription& raster, double wanted_spacing) {
  const int last = static_cast<int>(raster.levels.size()) - 1;
  int level = 0;
  while (level < last && spacing_of_level(raster, level + 1) <= wanted_spacing) ++level;
  return level;
}

Result<ElevationModel> ElevationModel::open(std::shared_ptr<const SurfaceDescription> description,
                                            cache::BlockCache& cache) {
  ElevationModel model;
  for (const Layer& layer : description->heights) {
    if (!layer.enabled) continue;
    Result<cache::CachedRaster> raster = cache::CachedRaster::open(*layer.source, cache, layer.source_id);
    if (!raster) return raster.error();
    const geo::GeodeticBounds reach = reach_of(layer.source->description());
    model.layers_.push_back({&layer, std::move(raster).value(), reach, {}});
  }
  model.description_ = std::move(description);
  return model;
}

Result<void> ElevationModel::heights(std::span<const geo::Vector<geo::Ecef>> normals, double wanted_spacing,
                                     std::span<double> metres) {
  places_.resize(normals.size());
  std::transform(normals.begin(), normals.end(), places_.begin(), geo::place_of_normal);
  return heights(std::span<const geo::LatLon>(places_), wanted_spacing, metres);
}

Result<void> ElevationModel::heights(std::span<const geo::LatLon> places, double wanted_spacing,
                                     std::span<double> metres) {
  spacings_.resize(places.size());
  return compose(places, wanted_spacing, metres, spacings_);
}

Result<void> ElevationModel::compose(std::span<const geo::LatLon> places, double wanted_spacing, std::span<double> metres,
                                     std::span<double> spacings) {
  assert(places.size() == metres.size() && places.size() == spacings.size());
  std::fill(metres.begin(), metres.end(), 0.0);
  std::fill(spacings.begin(), spacings.end(), std::numeric_limits<double>::infinity());
  for (HeightLayer& layer : layers_) {
    inside_.clear();
    inside_places_.clear();
    below_.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!holds(layer.reach, places[i])) continue;
      inside_.push_back(static_cast<std::uint32_t>(i));
      inside_places_.push_back(places[i]);
      below_.push_back(spacings[i]);
    }
    if (inside_.empty()) continue;
    if (Result<void> read = sample_layer(layer, wanted_spacing); !read) return read;
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      compose_one(metres[inside_[i]], samples_[i], layer.settings->adds);
      if (samples_[i].coverage > 0.0) spacings[inside_[i]] = std::min(spacings[inside_[i]], finest_[i]);
    }
  }
  return {};
}

/// Samples of a layer at inside_places_, its voids filled from coarser levels.
Result<void> ElevationModel::sample_layer(HeightLayer& layer, double wanted_spacing) {
  const source::RasterDescription& raster = layer.raster.description();
  const int level = level_for_spacing(raster, wanted_spacing);
  pixels_.resize(inside_places_.size());
  samples_.resize(pixels_.size());
  finest_.assign(pixels_.size(), spacing_of_level(raster, level));
  layer.raster.reader().to_pixels(inside_places_, pixels_);
  if (Result<void> read = layer.raster.sample_heights(level, pixels_, samples_); !read) return read;
  if (layer.settings->adds) return {};

  void_.clear();
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    if (samples_[i].coverage < 1.0 && is_finite(pixels_[i]) && bring_within(raster, level, pixels_[i]).reach > 0.0) {
      void_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  for (int coarse = level + 1; coarse <= kCoarsestFill && !void_.empty(); ++coarse) {
    const double spacing = spacing_of_level(raster, coarse);
    std::erase_if(void_, [&](std::uint32_t i) {
      return spacing > below_[i] || samples_[i].coverage >= bring_within(raster, level, pixels_[i]).reach;
    });
    void_pixels_.clear();
    for (const std::uint32_t i : void_) void_pixels_.push_back(bring_within(raster, level, pixels_[i]).pixel);
    void_samples_.resize(void_.size());
    if (Result<void> read = sample_voids(layer, coarse); !read) return read;
    for (std::size_t n = 0; n < void_.size(); ++n) {
      const std::uint32_t i = void_[n];
      const double missing = bring_within(raster, level, pixels_[i]).reach - samples_[i].coverage;
      const double added = missing * void_samples_[n].coverage;
      if (added <= 0.0) continue;
      if (samples_[i].coverage == 0.0) finest_[i] = spacing;
      const double coverage = samples_[i].coverage + added;
      samples_[i].metres += (void_samples_[n].metres - samples_[i].metres) * (added / coverage);
      samples_[i].coverage = coverage;
    }
  }
  return {};
}

/// Samples of a level at void_pixels_, whether the raster has that level or not.
Result<void> ElevationModel::sample_voids(HeightLayer& layer, int level) {
  const int last = static_cast<int>(layer.raster.description().levels.size()) - 1;
  if (level <= last) return layer.raster.sample_heights(level, void_pixels_, void_samples_);
  while (static_cast<int>(layer.beyond.size()) < level - last) {
    if (layer.beyond.empty()) {
      const Result<CoarseHeights> known = last_level(layer.raster);
      if (!known) return known.error();
      layer.beyond.push_back(next_level(*known));
    } else {
      layer.beyond.push_back(next_level(layer.beyond.back()));
    }
  }
  const CoarseHeights& heights = layer.beyond[static_cast<std::size_t>(level - last - 1)];
  std::transform(void_pixels_.begin(), void_pixels_.end(), void_samples_.begin(),
                 [&](const glm::dvec2& pixel) { return heights.sample(pixel); });
  return {};
}

Result<ElevationAnswer> ElevationModel::height_at(const geo::LatLon& place, Lookup lookup, double wanted_spacing) {
  ElevationAnswer answer{0.0, std::numeric_limits<double>::infinity()};
  if (lookup == Lookup::bilinear) {
    const Result<void> read = compose({&place, 1}, wanted_spacing, {&answer.metres, 1}, {&answer.spacing, 1});
    return read ? Result<ElevationAnswer>(answer) : read.error();
  }
  for (HeightLayer& layer : layers_) {
    if (!holds(layer.reach, place)) continue;
    const source::RasterDescription& raster = layer.raster.description();
    const int level = level_for_spacing(raster, wanted_spacing);
    glm::dvec2 pixel;
    layer.raster.reader().to_pixels({&place, 1}, {&pixel, 1});
    const source::LevelSize& full = raster.levels.front();
    const bool within = pixel.x >= 0.0 && pixel.x <= full.width && pixel.y >= 0.0 && pixel.y <= full.height;
    if (!within) continue;
    // At a sample's own place the bilinear value is the sample.
    const glm::dvec2 scale = source::level_scale(raster, level);
    const source::LevelSize& size = raster.levels[static_cast<std::size_t>(level)];
    const glm::dvec2 last(size.width - 1, size.height - 1);
    pixel = (glm::min(glm::floor(pixel * scale), last) + 0.5) / scale;
    cache::HeightSample sample;
    if (Result<void> read = layer.raster.sample_heights(level, {&pixel, 1}, {&sample, 1}); !read) return read.error();
    compose_one(answer.metres, sample, layer.settings->adds);
    if (sample.coverage > 0.0) answer.spacing = std::min(answer.spacing, spacing_of_level(raster, level));
  }
  return answer;
}

Result<geo::Vector<geo::Ecef>> ElevationModel::surface_normal_at(const geo::LatLon& place, double wanted_spacing) {
  const geo::Vector<geo::Ecef> up = geo::normal_at(place);
  const Result<ElevationAnswer> here = height_at(place, Lookup::bilinear, wanted_spacing);
  if (!here) return here.error();
  if (!std::isfinite(here->spacing)) return up;
  // Central differences over a thousandth of a sample: inside a cell that is the bilinear surface's own tangent, on a sample
  // or a cell's border the mean of both sides.
  const double step = 1e-3 * here->spacing / description_->ellipsoid.a();
  const double sine = std::sin(place.longitude.value), cosine = std::cos(place.longitude.value);
  const glm::dvec3 east(-sine, cosine, 0.0);
  const glm::dvec3 north = glm::cross(up.xyz, east);
  std::array<geo::Vector<geo::Ecef>, 4> normals;
  const std::array<glm::dvec3, 4> directions{-east, east, -north, north};
  for (std::size_t i = 0; i < 4; ++i) normals[i].xyz = glm::normalize(up.xyz + step * directions[i]);
  std::array<double, 4> metres{};
  if (Result<void> read = heights(normals, wanted_spacing, metres); !read) return read.error();
  std::array<glm::dvec3, 4> points;
  for (std::size_t i = 0; i < 4; ++i) {
    points[i] = geo::surface_point(description_->ellipsoid, normals[i]).xyz + metres[i] * normals[i].xyz;
  }
  return geo::Vector<geo::Ecef>{glm::normalize(glm::cross(points[1] - points[0], points[3] - points[2]))};
}

}  // namespace tellurion::surface
