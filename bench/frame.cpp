// A finished view frame by frame, and the choice of its tiles.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "bench/allocation_count.h"
#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

Result<Scene> open_rainier(const Setting& setting) {
  auto world = default_world_with(setting, {{globe::LayerGroup::height, kRainier}});
  if (!world) return world.error();
  return open_scene(std::move(*world), setting);
}

view::Pose rainier_pose(double heading = 0.0) { return pose_at(46.70, -121.76, 6500.0, heading, -10.0); }

Result<void> measure_frame(const Setting& setting, Report& report) {
  auto scene = open_rainier(setting);
  if (!scene) return scene.error();
  const view::Camera camera = camera_at(*scene, rainier_pose());
  const globe::ViewSettings settings;
  if (auto finished = finish(*scene, camera, settings); !finished) return finished;

  constexpr int kWarmUp = 10;
  const int count = setting.quick ? 20 : 200;
  std::vector<double> frame_ms, select_ms;
  frame_ms.reserve(static_cast<std::size_t>(count));
  select_ms.reserve(static_cast<std::size_t>(count));
  std::int64_t most_allocations = 0;
  for (int i = -kWarmUp; i < count; ++i) {
    const auto allocated_before = allocations_of_this_thread();
    const Stopwatch watch;
    const globe::FrameStats& stats = scene->view->draw(camera, settings);
    const auto allocated = allocations_of_this_thread();
    scene->thread->finish();
    if (i < 0) continue;
    frame_ms.push_back(watch.ms());
    select_ms.push_back(stats.select_ms);
    if (allocated) most_allocations = std::max(most_allocations, *allocated - *allocated_before);
  }
  const globe::FrameStats& stats = scene->view->stats();
  const std::string frames = fmt::format("{} frames", count);
  report.set("frame_ms", median(frame_ms), "median of " + frames);
  report.set("frame_ms_p99", quantile(frame_ms, 0.99), frames);
  report.set("select_ms", median(select_ms), "median of " + frames);
  report.set("triangles", static_cast<double>(stats.triangles), "30,000 are worth spending");
  report.set("tiles", stats.tiles_drawn);
  if (allocations_of_this_thread()) report.set("allocations", static_cast<double>(most_allocations), "the most of " + frames);
  return {};
}

/// The wanted error at which about `tiles` tiles are chosen; the view is finished with it.
Result<double> find_error_for(Scene& scene, const view::Camera& camera, int tiles) {
  double low = 0.05, high = 50.0;
  globe::ViewSettings settings;
  for (int i = 0; i < 10; ++i) {
    settings.sse_px = std::sqrt(low * high);
    if (auto finished = finish(scene, camera, settings); !finished) return finished.error();
    const int selected = scene.view->stats().tiles_selected;
    if (std::abs(selected - tiles) * 20 <= tiles) break;
    (selected > tiles ? low : high) = settings.sse_px;
  }
  return settings.sse_px;
}

/// Time to choose about `tiles` tiles while the view turns to and fro by a degree, all of it loaded.
Result<void> measure_selection(Scene& scene, bool quick, int tiles, const std::string& measure, Report& report) {
  const auto wanted = find_error_for(scene, camera_at(scene, rainier_pose()), tiles);
  if (!wanted) return wanted.error();
  globe::ViewSettings settings;
  settings.sse_px = *wanted;
  constexpr int kSteps = 20;  // a degree
  const auto camera_of = [&](int i) {
    const int step = i % (2 * kSteps);
    return camera_at(scene, rainier_pose(0.05 * (step < kSteps ? step : 2 * kSteps - step)));
  };
  for (int i = 0; i < 2 * kSteps; ++i) {
    if (auto finished = finish(scene, camera_of(i), settings); !finished) return finished;
  }
  std::vector<double> select_ms, selected;
  const int count = (quick ? 4 : 20) * 2 * kSteps;
  for (int i = 0; i < count; ++i) {
    const globe::FrameStats& stats = scene.view->update(camera_of(i), settings);
    select_ms.push_back(stats.select_ms);
    selected.push_back(stats.tiles_selected);
  }
  report.set(measure, median(select_ms), fmt::format("{} tiles at {:.2f} px, median of {} frames", median(selected), *wanted, count));
  return {};
}

Result<void> measure_cut(const Setting& setting, Report& report) {
  auto scene = open_rainier(setting);
  if (!scene) return scene.error();
  if (auto done = measure_selection(*scene, setting.quick, 100, "tiles_100", report); !done) return done;
  return measure_selection(*scene, setting.quick, 300, "tiles_300", report);
}

/// The first frame after a switch against the frames that follow.
Result<void> measure_switches(const Setting& setting, Report& report) {
  auto scene = open_rainier(setting);
  if (!scene) return scene.error();
  const view::Camera camera = camera_at(*scene, rainier_pose());
  const globe::ViewSettings plain;
  if (auto finished = finish(*scene, camera, plain); !finished) return finished;
  const auto frame_ms = [&](const globe::ViewSettings& settings) {
    const Stopwatch watch;
    scene->view->draw(camera, settings);
    scene->thread->finish();
    return watch.ms();
  };
  std::vector<double> preparing;
  for (bool more = true; more;) {
    const Stopwatch watch;
    more = scene->view->prepare_switches(plain);
    if (more) preparing.push_back(watch.ms());
  }
  double worst = 0;
  std::string worst_name;
  const auto measure = [&](const char* name, bool globe::ViewSettings::*which) {
    globe::ViewSettings switched = plain;
    switched.*which = !(switched.*which);
    const double first = frame_ms(switched);
    std::vector<double> following;
    for (int i = 0; i < (setting.quick ? 5 : 21); ++i) following.push_back(frame_ms(switched));
    frame_ms(plain);
    const double ratio = first / median(following);
    if (ratio > worst) worst = ratio, worst_name = name;
  };
  measure("lighting", &globe::ViewSettings::lighting);
  measure("atmosphere", &globe::ViewSettings::atmosphere);
  measure("wireframe", &globe::ViewSettings::wireframe);
  measure("bounds", &globe::ViewSettings::bounds);
  measure("tile_borders", &globe::ViewSettings::tile_borders);
  measure("antialiasing", &globe::ViewSettings::antialiasing);
  report.set("first_frame", worst, worst_name + ", the worst of six");
  report.set("prepare_ms", *std::max_element(preparing.begin(), preparing.end()), "the longest of six");
  return {};
}

}  // namespace

std::vector<Benchmark> frame_benchmarks() {
  return {{"frame.rainier",
           "finished view of Mt Rainier (46.70,-121.76,6500,0,-10), 1280x720, default world and 90 m heights, each frame waited for",
           {{"frame_ms", "ms", 40.0},
            {"frame_ms_p99", "ms", {}},
            {"select_ms", "ms", 0.3},
            {"triangles", "triangles", 50000.0},
            {"tiles", "tiles", {}},
            {"allocations", "allocations", 0.0}},
           measure_frame},
          {"frame.switches",
           "lighting, atmosphere, wireframe, bounds, tile borders and antialiasing switched in the same view: the first frame",
           {{"first_frame", "of the median", {}}, {"prepare_ms", "ms", {}}},
           measure_switches},
          {"cut.select",
           "choosing the tiles of the view of Mt Rainier, turning by 0.05 degrees a frame, everything loaded",
           {{"tiles_100", "ms", 0.3}, {"tiles_300", "ms", {}}},
           measure_cut}};
}

}  // namespace tellurion::bench
