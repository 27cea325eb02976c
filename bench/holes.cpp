// Random views whose frame lies wholly inside the planet's outline: none may show the background.
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>

#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"

namespace tellurion::bench {
namespace {

constexpr std::uint64_t kSeed = 20260101;
constexpr PictureSize kSize{320, 180};
constexpr double kDeepest = -11e3;  // metres; deeper than all elevation data
constexpr std::array<int, 3> kExaggerations{1, 10, 100};

/// Places where something ends or meets: poles, the antimeridian, corners of the cube's faces, borders of rasters.
constexpr std::array<std::array<double, 2>, 8> kPlaces{
    {{46.85, -121.76}, {27.99, 86.93}, {90.0, 0.0}, {-90.0, 0.0}, {0.0, 180.0}, {35.2644, 45.0}, {0.0, 45.0}, {47.0, -121.5}}};

struct HoleView {
  view::Pose pose;
  int exaggeration = 1;
};

/// Seeded random views.
class HoleViews {
 public:
  HoleViews(const Scene& scene, globe::HeightSampler& elevation) : scene_(scene), elevation_(elevation) {}

  /// The next whose four corners meet the ellipsoid that lies as deep as the deepest ground displayed: as an outline has no
  /// dents, the whole frame lies inside.
  Result<HoleView> next() {
    for (;;) {
      const int exaggeration = kExaggerations[std::uniform_int_distribution<std::size_t>(0, 2)(random_)];
      const auto [latitude, longitude] = random_place();
      const auto ground = elevation_.height_at({to_radians(Degrees(latitude)), to_radians(Degrees(longitude))});
      if (!ground) return ground.error();
      const double height = exaggeration * ground->height.value + std::pow(10.0, between(1.7, 7.3));
      const view::Pose pose = pose_at(latitude, longitude, height, between(0.0, 360.0), between(-90.0, 0.0), between(-180.0, 180.0));
      if (lies_inside(pose, exaggeration)) return HoleView{pose, exaggeration};
    }
  }

 private:
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  std::array<double, 2> random_place() {
    if (between(0.0, 1.0) < 0.5) {
      const auto& place = kPlaces[std::uniform_int_distribution<std::size_t>(0, kPlaces.size() - 1)(random_)];
      std::normal_distribution<double> near(0.0, 0.3);
      return {std::clamp(place[0] + near(random_), -90.0, 90.0), place[1] + near(random_)};
    }
    return {std::asin(between(-1.0, 1.0)) * 180.0 / std::numbers::pi, between(-180.0, 180.0)};
  }

  bool lies_inside(const view::Pose& pose, int exaggeration) const {
    const view::Camera camera = camera_at(scene_, pose, kSize);
    for (const glm::dvec2 corner : {glm::dvec2(0, 0), glm::dvec2(kSize.width, 0), glm::dvec2(0, kSize.height), glm::dvec2(kSize.width, kSize.height)}) {
      if (geo::intersect_ray(scene_.globe->ellipsoid(), Metres(kDeepest * exaggeration), camera.eye, camera.ray(corner)) < 0.0) return false;
    }
    return true;
  }

  const Scene& scene_;
  globe::HeightSampler& elevation_;
  std::mt19937_64 random_{kSeed};
};

globe::ViewSettings hole_settings(int exaggeration) {
  globe::ViewSettings settings;
  settings.exaggeration = exaggeration;
  settings.atmosphere = false;
  settings.clear = {1.0f, 0.0f, 1.0f};
  return settings;
}

int background_pixels(Scene& scene, const view::Camera& camera, const globe::ViewSettings& settings) {
  const raster::Image image = scene.view->picture(camera, settings);
  int count = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] == 255 && image.rgba[i + 1] == 0 && image.rgba[i + 2] == 255) ++count;
  }
  return count;
}

/// The number of background pixels so far, and the views that have some.
struct Tally {
  std::int64_t pixels = 0;
  std::string views;

  void add(int count, const HoleView& view) {
    if (count == 0) return;
    pixels += count;
    views += fmt::format("{}{} pixels at --camera={} --exaggeration {}", views.empty() ? "" : "; ", count, to_text(view.pose), view.exaggeration);
  }
  std::string note(int count) const { return fmt::format("{} views{}{}", count, views.empty() ? "" : ": ", views); }
};

Result<void> measure_holes(const Setting& setting, Report& report) {
  auto world = default_world_with(setting, {{globe::LayerGroup::height, kArctic}, {globe::LayerGroup::height, kRainier}, {globe::LayerGroup::height, kEverest}});
  if (!world) return world.error();
  auto scene = open_scene(std::move(*world), setting);
  if (!scene) return scene.error();
  auto elevation = scene->globe->height_sampler();
  if (!elevation) return elevation.error();
  if (background_pixels(*scene, camera_at(*scene, pose_at(0, 0, 2e7, 0, -90), kSize), hole_settings(1)) == 0)
    return {ErrorCode::internal, "the background does not show where it should"};

  HoleViews views(*scene, *elevation);
  Tally loading, finished;
  const int count = setting.quick ? 60 : 2000;
  for (int i = 0; i < count; ++i) {
    const auto view = views.next();
    if (!view) return view.error();
    const view::Camera camera = camera_at(*scene, view->pose, kSize);
    const auto settings = hole_settings(view->exaggeration);
    for (int update = 0; update < 1 << (i % 4); ++update) {
      if (update > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      scene->view->update(camera, settings);
    }
    loading.add(background_pixels(*scene, camera, settings), *view);
    if (auto done = finish(*scene, camera, settings); !done) return done;
    finished.add(background_pixels(*scene, camera, settings), *view);
    if ((i + 1) % 100 == 0) fmt::print(stderr, "tellurion: {} of {} views, {} and {} pixels\n", i + 1, count, loading.pixels, finished.pixels);
  }
  report.set("loading", static_cast<double>(loading.pixels), loading.note(count));
  report.set("finished", static_cast<double>(finished.pixels), finished.note(count));
  return {};
}

}  // namespace

std::vector<Benchmark> hole_benchmarks() {
  return {{"holes.views",
           fmt::format("pixels that show the background; random views inside the outline (seed {}), 320x180, exaggeration 1, 10, 100", kSeed),
           {{"loading", "pixels", 0.0}, {"finished", "pixels", 0.0}},
           measure_holes}};
}

}  // namespace tellurion::bench
