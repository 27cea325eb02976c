#include "bench/scene.h"

#include <fmt/format.h>

#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

constexpr std::chrono::minutes kPatience{15};
constexpr Degrees kVerticalFov{45.0};

Result<void> add_layers(globe::World& world, const Setting& setting, std::initializer_list<DataLayer> layers) {
  for (const DataLayer& layer : layers) {
    globe::LayerSpec spec;
    spec.name = layer.path;
    spec.group = layer.group;
    spec.source.path = setting.data / layer.path;
    if (layer.group == globe::LayerGroup::height) spec.source.vertical = "ellipsoid";
    std::error_code failure;
    if (!std::filesystem::exists(spec.source.path, failure))
      return {ErrorCode::not_found, fmt::format("{} is missing; --data names the folder of the larger data sets",
                                                spec.source.path.string())};
    world.layers.push_back(std::move(spec));
  }
  return {};
}

double median_frame_ms(Scene& scene, const view::Camera& camera, int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    const Stopwatch watch;
    scene.view->draw(camera, {});
    scene.thread->finish();
    times.push_back(watch.ms());
  }
  return median(times);
}

}  // namespace

Result<globe::World> default_world_with(const Setting& setting, std::initializer_list<DataLayer> layers) {
  auto world = globe::resolve_world("");
  if (!world) return world.error();
  if (auto added = add_layers(*world, setting, layers); !added) return added.error();
  return world;
}

Result<globe::World> world_of(const Setting& setting, std::initializer_list<DataLayer> layers) {
  globe::World world;
  if (auto added = add_layers(world, setting, layers); !added) return added.error();
  return world;
}

Result<std::unique_ptr<globe::Globe>> open_with_tables(globe::World world, const Setting& setting) {
  globe::GlobeOptions options;
  options.cache_folder = setting.scratch / "tables";
  auto globe = globe::Globe::open(std::move(world), options);
  if (!globe) return globe.error();
  if (!(*globe)->wait_for_tables(std::chrono::steady_clock::now() + kPatience))
    return Error{ErrorCode::unavailable, "the error tables are not ready after a quarter of an hour"};
  return globe;
}

Result<Scene> open_scene(globe::World world, const Setting& setting, std::size_t gpu_bytes) {
  Scene scene;
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  if (!thread) return thread.error();
  scene.thread = std::move(*thread);
  auto globe = open_with_tables(std::move(world), setting);
  if (!globe) return globe.error();
  scene.globe = std::move(*globe);
  auto view = globe::GlobeView::create(*scene.globe, *scene.thread, gpu_bytes);
  if (!view) return view.error();
  scene.view = std::move(*view);
  return scene;
}

Result<void> finish(Scene& scene, const view::Camera& camera, const globe::ViewSettings& settings) {
  if (scene.view->finish(camera, settings, std::chrono::steady_clock::now() + kPatience)) return {};
  return {ErrorCode::unavailable, fmt::format("the view of {} was not finished within a quarter of an hour",
                                              to_text(view::pose_of(scene.globe->ellipsoid(), camera)))};
}

Result<FrameRatio> frame_ratio(Scene& a, Scene& b, const view::Camera& camera, bool quick) {
  for (Scene* scene : {&a, &b}) {
    if (auto finished = finish(*scene, camera, {}); !finished) return finished.error();
  }
  constexpr int kFrames = 5;
  const int rounds = quick ? 5 : 21;
  std::vector<double> ratios;
  for (int round = 0; round < rounds; ++round) {  // in turn, so that other work on the machine falls on both
    const double of_a = median_frame_ms(a, camera, kFrames), of_b = median_frame_ms(b, camera, kFrames);
    ratios.push_back(of_a / of_b);
  }
  return FrameRatio{median(ratios), fmt::format("median of {} rounds of {} frames of each; {} and {} tiles", rounds, kFrames, a.view->stats().tiles_drawn, b.view->stats().tiles_drawn)};
}

view::Pose pose_at(double latitude, double longitude, double height, double heading, double pitch, double roll) {
  view::Pose pose;
  pose.position = {to_radians(Degrees(latitude)), to_radians(Degrees(longitude)), EllipsoidalHeight(height)};
  pose.heading = to_radians(Degrees(heading));
  pose.pitch = to_radians(Degrees(pitch));
  pose.roll = to_radians(Degrees(roll));
  return pose;
}

std::string to_text(const view::Pose& pose) {
  return fmt::format("{:.9g},{:.9g},{:.9g},{:.6g},{:.6g},{:.6g}", to_degrees(pose.position.latitude).value,
                     to_degrees(pose.position.longitude).value, pose.position.height.value, to_degrees(pose.heading).value,
                     to_degrees(pose.pitch).value, to_degrees(pose.roll).value);
}

view::Camera camera_at(const Scene& scene, const view::Pose& pose, PictureSize size) {
  return view::make_camera(scene.globe->ellipsoid(), pose, to_radians(kVerticalFov), size.width, size.height);
}

}  // namespace tellurion::bench
