// Planets and a loader that exist only as numbers, for the tests of the cut.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "geo/ellipsoid.h"
#include "surface/selection_error.h"
#include "surface/tile_tree.h"
#include "view/camera.h"

namespace tellurion::surface::testing {

inline constexpr std::chrono::milliseconds kFrameTime{16};

/// A planet that is equally rough everywhere: its error halves with every level.
struct EvenPlanet : SurfaceFacts {
  double root_error = 4000;       ///< metres
  double relief = 4000;           ///< heights lie within +- relief at the root, less below
  int table_level = 30;           ///< deepest level with an error in the facts
  int colour_level = 6;           ///< deepest level with colour of its own
  int slope_level = 8;
  geo::Ellipsoid ellipsoid = geo::kWgs84;

  TileFacts facts_of(const geo::TileKey& key) const override {
    TileFacts facts;
    const int range_level = std::min<int>(key.level, table_level);
    facts.min_height = static_cast<float>(-relief * std::exp2(-0.5 * range_level));
    facts.max_height = static_cast<float>(relief * std::exp2(-0.5 * range_level));
    if (key.level <= table_level) facts.height_error = error_of(key.level);
    facts.own_colour = key.level <= colour_level;
    facts.finer_colour_below = key.level < colour_level;
    facts.own_slopes = key.level <= slope_level && (key.x + key.y) % 3 != 0;
    return facts;
  }

  /// What a worker would find: a function of the key.
  TileMetrics metrics_of(const geo::TileKey& key) const {
    TileMetrics metrics;
    metrics.min_height = static_cast<float>(-relief * std::exp2(-0.5 * key.level) * 0.9);
    metrics.max_height = static_cast<float>(relief * std::exp2(-0.5 * key.level) * 0.9);
    const float curvature = full_grid_curvature_error(ellipsoid, tile_shape(ellipsoid, key));
    metrics.step_count = 3;
    for (std::size_t i = 0; i < 3; ++i) {
      const float coarser = std::exp2(static_cast<float>(i) / 2);
      const HeightError finest = error_of(key.level);
      metrics.steps[i] = {{finest.bound * coarser, finest.common * coarser}, curvature * coarser};
    }
    return metrics;
  }

  bool has_slopes(const geo::TileKey& key) const { return facts_of(key).own_slopes && (key.x ^ key.y) % 5 != 0; }

 private:
  /// Now what is common decides, now the bound.
  HeightError error_of(int level) const {
    const auto bound = static_cast<float>(root_error * std::exp2(-level));
    return {bound, level % 3 == 0 ? 0.1f * bound : 0.8f * bound};
  }
};

/// Brings what the tree asks for, a few parts a frame, in any order, and fails now and then.
class Loader {
 public:
  Loader(TileTree& tree, const EvenPlanet& planet, std::uint64_t seed, double failure_rate = 0)
      : tree_(tree), planet_(planet), random_(seed), failure_rate_(failure_rate) {}

  void load_roots() {
    for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) deliver({{face, 0, 0, 0}, Part::geometry, 0});
  }

  void work(const Selection& selection, std::chrono::steady_clock::time_point now, std::size_t starts,
            std::size_t arrivals) {
    for (const TileRequest& request : selection.requests) {
      if (starts-- == 0) break;
      tree_.started(request.key, request.part);
      under_way_.push_back(request);
    }
    std::ranges::shuffle(under_way_, random_);
    for (; arrivals > 0 && !under_way_.empty(); --arrivals) {
      const TileRequest request = under_way_.back();
      under_way_.pop_back();
      if (!tree_.is_wanted(request.key, request.part)) {
        tree_.cancelled(request.key, request.part);
      } else if (std::uniform_real_distribution<>()(random_) < failure_rate_) {
        tree_.failed(request.key, request.part, now + 5 * kFrameTime);
      } else {
        deliver(request);
      }
    }
  }

  void deliver(const TileRequest& request) {
    if (request.part == Part::geometry) {
      tree_.arrived_geometry(request.key, planet_.metrics_of(request.key), planet_.has_slopes(request.key));
    } else {
      tree_.arrived_colour(request.key);
    }
  }

 private:
  TileTree& tree_;
  const EvenPlanet& planet_;
  std::mt19937_64 random_;
  double failure_rate_;
  std::vector<TileRequest> under_way_;
};

/// A tree with its loader and its clock.
class Flight {
 public:
  explicit Flight(const EvenPlanet& planet, std::uint64_t seed = 1, double failure_rate = 0)
      : tree(planet.ellipsoid, std::make_shared<EvenPlanet>(planet)), loader(tree, planet, seed, failure_rate) {
    loader.load_roots();
  }

  const Selection& frame(const view::Camera& camera, const SelectionSettings& settings, std::size_t starts = 1000,
                         std::size_t arrivals = 1000) {
    now += kFrameTime;
    const Selection& selection = tree.select(camera, settings, now);
    loader.work(selection, now, starts, arrivals);
    return selection;
  }

  /// Frames until the picture is complete; null if it does not become so.
  const Selection* finish(const view::Camera& camera, const SelectionSettings& settings) {
    for (int i = 0; i < 500; ++i) {
      const Selection& selection = frame(camera, settings);
      if (selection.stats.complete) return &selection;
    }
    return nullptr;
  }

  TileTree tree;
  Loader loader;
  std::chrono::steady_clock::time_point now{};
};

inline view::Camera camera_at(const geo::Ellipsoid& ellipsoid, double lat, double lon, double height, double heading,
                              double pitch) {
  const view::Pose pose{{to_radians(Degrees(lat)), to_radians(Degrees(lon)), EllipsoidalHeight(height)},
                        to_radians(Degrees(heading)), to_radians(Degrees(pitch)), Radians(0)};
  return view::make_camera(ellipsoid, pose, to_radians(Degrees(45)), 1280, 720);
}

/// Anywhere over the planet, at any height from `lowest` to 20,000 km, looking anywhere below 10 degrees above the horizon.
inline view::Camera random_camera(const geo::Ellipsoid& ellipsoid, std::mt19937_64& random, double lowest = 10) {
  const auto between = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  const double lat = std::asin(between(-1, 1)) * 180 / std::numbers::pi;
  const double height = std::exp(between(std::log(lowest), std::log(2e7)));
  return camera_at(ellipsoid, lat, between(-180, 180), height, between(0, 360), between(-90, 10));
}

}  // namespace tellurion::surface::testing
