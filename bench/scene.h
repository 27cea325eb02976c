// Worlds and views as the benchmarks need them.
#pragma once

#include <chrono>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <string>

#include "base/result.h"
#include "bench/registry.h"
#include "globe/globe.h"
#include "globe/globe_view.h"
#include "globe/world.h"
#include "gpu/render_thread.h"
#include "view/camera.h"

namespace tellurion::bench {

/// A file of the larger data sets, as a layer.
struct DataLayer {
  globe::LayerGroup group;
  std::string path;  ///< relative to Setting::data
};

inline constexpr const char* kRainier = "earth/regional/mt_rainier_90m.tif";
inline constexpr const char* kEverest = "earth/regional/mt_everest_90m.tif";
inline constexpr const char* kEtopo5 = "earth/elevation/etopo5.tif";
inline constexpr const char* kArctic = "earth/elevation/arctic_polar_stereographic.tif";
inline constexpr const char* kBlueMarble = "earth/imagery/blue_marble_4096.jpg";
inline constexpr const char* kLargeBlueMarble = "earth/imagery/bluemarble_bathy_8192x4096.jpg";

/// The embedded default world with more layers on top. Errors: not_found, naming the file that is missing.
Result<globe::World> default_world_with(const Setting& setting, std::initializer_list<DataLayer> layers);
/// The Earth with these layers alone. Errors likewise.
Result<globe::World> world_of(const Setting& setting, std::initializer_list<DataLayer> layers);

/// A world with its error tables ready; they are kept within the run.
Result<std::unique_ptr<globe::Globe>> open_with_tables(globe::World world, const Setting& setting);

/// A world and a view of it, without a window.
struct Scene {
  std::unique_ptr<gpu::RenderThread> thread;
  std::unique_ptr<globe::Globe> globe;
  std::unique_ptr<globe::GlobeView> view;
};
Result<Scene> open_scene(globe::World world, const Setting& setting, std::size_t gpu_bytes = std::size_t{512} << 20);

/// Errors: unavailable, if the picture is not finished within a quarter of an hour.
Result<void> finish(Scene& scene, const view::Camera& camera, const globe::ViewSettings& settings);

/// The time of `a`'s frames over that of `b`'s, in finished views. Errors: as `finish`.
struct FrameRatio {
  double value;
  std::string note;
};
Result<FrameRatio> frame_ratio(Scene& a, Scene& b, const view::Camera& camera, bool quick);

/// Degrees and metres above the ellipsoid.
view::Pose pose_at(double latitude, double longitude, double height, double heading, double pitch, double roll = 0.0);
/// As --camera takes it.
std::string to_text(const view::Pose& pose);

struct PictureSize {
  int width = 1280;
  int height = 720;
};
/// A camera with the default field of view.
view::Camera camera_at(const Scene& scene, const view::Pose& pose, PictureSize size = {});

}  // namespace tellurion::bench
