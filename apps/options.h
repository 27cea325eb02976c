// The options that commands share, as the contract of the command line names them.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "globe/api.h"

namespace CLI {
class App;
class Validator;
}

namespace tellurion::apps {

/// Exit statuses of the program.
enum ExitStatus { kDone = 0, kFailed = 1, kWrongUsage = 2, kDataMissing = 3 };

struct Options {
  std::string world;   ///< empty: the embedded default world
  std::optional<view::Pose> camera;
  int width = 1280;
  int height = 720;
  double vertical_fov_degrees = 45.0;
  globe::ViewSettings view;
  std::optional<double> after_ms;
  double timeout_seconds = 120.0;
  int workers = -1;
  std::size_t gpu_cache_bytes = std::size_t{512} << 20;
  std::size_t memory_cache_bytes = std::size_t{512} << 20;
  std::filesystem::path disk_cache = globe::default_cache_folder();
  std::size_t disk_cache_bytes = std::size_t{4} << 30;
  bool offline = false;
  gpu::Api api = gpu::Api::core;
  std::filesystem::path out;
  std::filesystem::path stats_file;
  std::filesystem::path trace_file;
  std::filesystem::path geo_file;
};

/// The folder of what is kept, and its bound.
void add_disk_cache(CLI::App& app, Options& options);

/// Accepts numbers from `least` to `most`; not a number is none.
CLI::Validator in_range(double least, double most);

/// A file's name with this ending, or with none.
CLI::Validator has_ending(const std::string& wanted);

/// WORLD, as the first word that is no option.
void add_world(CLI::App& app, Options& options, bool required);
/// --size, --vfov, --sse and all else that says what a picture shows and how well.
void add_view_options(CLI::App& app, Options& options);
/// --workers, --gpu-cache and all else that bounds what the program uses.
void add_resource_options(CLI::App& app, Options& options);
void add_camera(CLI::App& app, Options& options);

/// One line on standard error: what failed, where, what to do. Gives the exit status.
int report(const Error& error);

/// What the render thread does while tiles are built: draw all the time, or wait until a picture is finished.
enum class RenderThreadUse { draws, waits };

/// Opens the world that the options name and prints its hints.
Result<std::unique_ptr<globe::Globe>> open_globe(const Options& options, RenderThreadUse use = RenderThreadUse::draws);

/// The camera asked for, else the world's home: its finest data, or the whole body. Waits for what catalogues have, as long as `patience`.
view::Pose camera_or_home(const Options& options, globe::Globe& globe, std::chrono::milliseconds patience);

/// Says on standard error, once, that the camera is below the ground.
class GroundWarning {
 public:
  explicit GroundWarning(const globe::Globe& globe) : globe_(&globe) {}
  void check(const geo::Geodetic& eye, double exaggeration);

 private:
  const globe::Globe* globe_;
  std::optional<globe::HeightSampler> sampler_;  ///< since the first check
};

/// Writes text to a file. Errors: unavailable.
Result<void> write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace tellurion::apps
