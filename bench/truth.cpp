// What pictures show against the elevation at the same places.
#include <cmath>

#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

struct TruthView {
  const char* name;
  const char* conditions;
  const char* layer;  ///< heights over the default world; null: none
  double latitude, longitude;
  double above_ground;  ///< metres over the ground as displayed
  double heading, pitch;
};

constexpr TruthView kViews[] = {
    {"ground", "50 m above the ground south of Mt Rainier, looking up to it", kRainier, 46.70, -121.76, 50.0, 0.0, -5.0},
    {"rainier", "3 km above the ground south of Mt Rainier", kRainier, 46.70, -121.76, 3000.0, 0.0, -20.0},
    {"everest", "10 km above the ground south of Mt Everest", kEverest, 27.80, 86.90, 10e3, 20.0, -20.0},
    {"space", "3,000 km above the Alps", nullptr, 46.0, 8.0, 3e6, 0.0, -90.0}};
constexpr int kExaggerations[] = {1, 10, 100};

struct Errors {
  double share_within_1px = 0;
  double worst_px = 0;
  std::size_t pixels = 0;
};

/// |height shown - height of the elevation there|, in pixels at its distance.
Result<Errors> errors_of(const render::GeoPicture& shown, globe::HeightSampler& elevation, double exaggeration, double pixel_angle) {
  Errors errors;
  std::size_t within = 0;
  for (std::size_t i = 0; i < shown.elevation.size(); ++i) {
    if (std::isnan(shown.elevation[i])) continue;
    const auto truth = elevation.height_at({to_radians(Degrees(shown.latitude[i])), to_radians(Degrees(shown.longitude[i]))});
    if (!truth) return truth.error();
    const double error = std::abs(shown.elevation[i] - exaggeration * truth->height.value) / (shown.distance[i] * pixel_angle);
    ++errors.pixels;
    if (error < 1.0) ++within;
    errors.worst_px = std::max(errors.worst_px, error);
  }
  if (errors.pixels == 0) return Error{ErrorCode::internal, "the picture shows no ground"};
  errors.share_within_1px = static_cast<double>(within) / static_cast<double>(errors.pixels);
  return errors;
}

Result<void> measure_truth(const TruthView& truth, const Setting& setting, Report& report) {
  auto world = truth.layer ? default_world_with(setting, {{globe::LayerGroup::height, truth.layer}}) : default_world_with(setting, {});
  if (!world) return world.error();
  constexpr std::size_t kRoom = std::size_t{2} << 30;  // mountains a hundred times their height are a gigabyte of tiles
  auto scene = open_scene(std::move(*world), setting, kRoom);
  if (!scene) return scene.error();
  auto elevation = scene->globe->height_sampler();
  if (!elevation) return elevation.error();
  const auto ground = elevation->height_at({to_radians(Degrees(truth.latitude)), to_radians(Degrees(truth.longitude))});
  if (!ground) return ground.error();
  for (const int exaggeration : kExaggerations) {
    globe::ViewSettings settings;
    settings.exaggeration = exaggeration;
    const double height = exaggeration * ground->height.value + truth.above_ground;
    const view::Camera camera = camera_at(*scene, pose_at(truth.latitude, truth.longitude, height, truth.heading, truth.pitch));
    if (auto finished = finish(*scene, camera, settings); !finished) return finished;
    const auto errors = errors_of(scene->view->measure(camera, settings), *elevation, exaggeration, camera.pixel_angle());
    if (!errors) return errors.error();
    const std::string note = fmt::format("{} pixels, chosen for {:.2f} px", errors->pixels, scene->view->stats().max_error_px);
    report.set(fmt::format("x{}.share_within_1px", exaggeration), errors->share_within_1px, note);
    report.set(fmt::format("x{}.worst_px", exaggeration), errors->worst_px, note);
  }
  return {};
}

}  // namespace

std::vector<Benchmark> truth_benchmarks() {
  std::vector<Benchmark> all;
  for (const TruthView& truth : kViews) {
    Benchmark benchmark;
    benchmark.name = fmt::format("truth.{}", truth.name);
    benchmark.conditions = fmt::format("{}; 1280x720, --sse 1, every pixel that shows ground", truth.conditions);
    for (const int exaggeration : kExaggerations) {
      benchmark.measures.push_back({fmt::format("x{}.share_within_1px", exaggeration), "share", 0.999, Better::higher});
      benchmark.measures.push_back({fmt::format("x{}.worst_px", exaggeration), "px", 2.0});
    }
    benchmark.run = [&truth](const Setting& setting, Report& report) { return measure_truth(truth, setting, report); };
    all.push_back(std::move(benchmark));
  }
  return all;
}

}  // namespace tellurion::bench
