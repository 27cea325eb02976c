// A pole against the equator, at the same poses in a world of even data.
#include <cmath>

#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

constexpr double kLowest = 1e6;  // metres; the octave above it

struct Place {
  double latitude, longitude;
};
constexpr Place kPole{89.95, 20.0}, kEquator{0.05, -150.0};

/// Headings all round, heights over an octave, five pitches.
view::Pose pose_number(int i, int count, const Place& place) {
  const double height = kLowest * std::exp2(static_cast<double>(i * 7 % count) / count);
  return pose_at(place.latitude, place.longitude, height, 360.0 * i / count, -35.0 - 5.0 * (i % 5));
}

struct Cost {
  std::vector<double> tiles, triangles, frame_ms, load_ms;
};

/// Adds the figures of a finished view.
Result<void> add_cost(Scene& scene, const view::Camera& camera, Cost& cost) {
  const globe::ViewSettings settings;
  const Stopwatch loading;
  if (auto finished = finish(scene, camera, settings); !finished) return finished;
  cost.load_ms.push_back(loading.ms());
  std::vector<double> frame_ms;
  for (int i = 0; i < 6; ++i) {
    const Stopwatch watch;
    scene.view->draw(camera, settings);
    scene.thread->finish();
    if (i > 0) frame_ms.push_back(watch.ms());
  }
  const globe::FrameStats& stats = scene.view->stats();
  cost.tiles.push_back(stats.tiles_selected);
  cost.triangles.push_back(static_cast<double>(stats.triangles));
  cost.frame_ms.push_back(median(frame_ms));
  return {};
}

Result<void> measure_cost(const Setting& setting, Report& report) {
  auto world = world_of(setting, {{globe::LayerGroup::height, kEtopo5}, {globe::LayerGroup::color, kBlueMarble}});
  if (!world) return world.error();
  auto scene = open_scene(std::move(*world), setting);
  if (!scene) return scene.error();
  Cost pole, equator;
  const int count = setting.quick ? 10 : 50;
  for (int i = 0; i < count; ++i) {
    if (auto done = add_cost(*scene, camera_at(*scene, pose_number(i, count, kPole)), pole); !done) return done;
    if (auto done = add_cost(*scene, camera_at(*scene, pose_number(i, count, kEquator)), equator); !done) return done;
  }
  double worst = 0.0;
  for (std::size_t i = 0; i < pole.tiles.size(); ++i) worst = std::max(worst, pole.tiles[i] / equator.tiles[i]);
  const std::string medians = fmt::format("medians of {} poses, pole by equator", count);
  report.set("tiles_ratio", median(pole.tiles) / median(equator.tiles),
             fmt::format("{}: {} by {} tiles", medians, median(pole.tiles), median(equator.tiles)));
  report.set("tiles_ratio_max", worst, fmt::format("the worst of {} poses", count));
  report.set("triangles_ratio", median(pole.triangles) / median(equator.triangles),
             fmt::format("{}: {} by {} triangles", medians, median(pole.triangles), median(equator.triangles)));
  report.set("frame_ms_ratio", median(pole.frame_ms) / median(equator.frame_ms),
             fmt::format("{}: {:.1f} by {:.1f} ms", medians, median(pole.frame_ms), median(equator.frame_ms)));
  return {};
}

/// Every view with a globe of its own, so that nothing is loaded before.
Result<void> measure_loading(const Setting& setting, Report& report) {
  Cost pole, equator;
  const int count = setting.quick ? 4 : 16;
  for (int i = -1; i < count; ++i) {  // the first pair makes the error tables
    for (const auto& [place, cost] : {std::pair(&kPole, &pole), std::pair(&kEquator, &equator)}) {
      auto world = world_of(setting, {{globe::LayerGroup::height, kEtopo5}, {globe::LayerGroup::height, kArctic}, {globe::LayerGroup::color, kBlueMarble}});
      if (!world) return world.error();
      auto scene = open_scene(std::move(*world), setting);
      if (!scene) return scene.error();
      Cost unused;
      const view::Camera camera = camera_at(*scene, pose_number(std::max(i, 0), count, *place));
      if (auto done = add_cost(*scene, camera, i < 0 ? unused : *cost); !done) return done;
    }
  }
  report.set("load_ratio", median(pole.load_ms) / median(equator.load_ms),
             fmt::format("medians of {} poses, pole by equator: {:.0f} by {:.0f} ms", count, median(pole.load_ms), median(equator.load_ms)));
  return {};
}

}  // namespace

std::vector<Benchmark> pole_benchmarks() {
  return {{"poles.even",
           "89.95 N and the equator, 1280x720, 1,000 to 2,000 km high, pitch -35 to -55, etopo5 and Blue Marble",
           {{"tiles_ratio", "ratio", 1.1},
            {"tiles_ratio_max", "ratio", 1.5},
            {"triangles_ratio", "ratio", 1.25},
            {"frame_ms_ratio", "ratio", 1.25}},
           measure_cost},
          {"poles.polar_data",
           "the same with heights in a polar stereographic projection over it, each view loaded from nothing, tables kept",
           {{"load_ratio", "ratio", 1.25}},
           measure_loading}};
}

}  // namespace tellurion::bench
