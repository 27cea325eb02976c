#include <chrono>
#include "options.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace tellurion::apps {
namespace {

/// Splits `text` at the first `separator`; the second part is empty if there is none.
std::pair<std::string, std::string> split(const std::string& text, char separator) {
  const auto at = text.find(separator);
  if (at == std::string::npos) return {text, ""};
  return {text.substr(0, at), text.substr(at + 1)};
}

template <class Number>
Number parse_number(const std::string& text, Number least, Number most, const std::string& what) {
  Number value{};
  if (!CLI::detail::lexical_cast(text, value) || !(value >= least && value <= most))
    throw CLI::ValidationError(what, fmt::format("\"{}\" is not a number from {} to {}", text, least, most));
  return value;
}

void set_size(const std::string& text, Options& options) {
  if (std::count(text.begin(), text.end(), 'x') != 1) throw CLI::ValidationError("--size", fmt::format("\"{}\" is not WIDTHxHEIGHT in pixels", text));
  const auto [width, height] = split(text, 'x');
  options.width = parse_number<int>(width, 1, 16384, "--size");
  options.height = parse_number<int>(height, 1, 16384, "--size");
}

void set_colour(const std::string& text, glm::vec3& colour) {
  const bool hexadecimal = text.size() == 6 && text.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (!hexadecimal) throw CLI::ValidationError("--clear", fmt::format("\"{}\" is not a colour written RRGGBB", text));
  const auto bits = std::stoul(text, nullptr, 16);
  for (int i = 0; i < 3; ++i) colour[i] = static_cast<float>((bits >> (16 - 8 * i)) & 0xff) / 255.0f;
}

void set_disk_cache(const std::string& text, Options& options) {
  const auto comma = text.rfind(',');
  options.disk_cache = text.substr(0, comma);
  if (comma != std::string::npos)
    options.disk_cache_bytes = parse_number<std::size_t>(text.substr(comma + 1), 0, std::size_t{1} << 30, "--disk-cache") << 20;
}

CLI::Option* add_text(CLI::App& app, const std::string& name, std::function<void(const std::string&)> take, const std::string& help,
                      const std::string& type) {
  return app.add_option_function<std::string>(name, std::move(take), help)->type_name(type);
}

}  // namespace

void add_disk_cache(CLI::App& app, Options& options) {
  add_text(app, "--disk-cache", [&options](const std::string& t) { set_disk_cache(t, options); }, "folder of what is kept, and its bound in MB", "DIR[,MB]");
}

CLI::Validator in_range(double least, double most) {
  const auto check = [least, most](const std::string& text) {
    double value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && value >= least && value <= most;
    return good ? std::string() : fmt::format("\"{}\" is not a number from {} to {}", text, least, most);
  };
  return CLI::Validator(check, fmt::format("{} to {}", least, most));
}

CLI::Validator has_ending(const std::string& wanted) {
  const auto check = [wanted](const std::string& text) {
    std::string ending = std::filesystem::path(text).extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending.empty() || ending == wanted ? std::string() : fmt::format("\"{}\" does not end in {}: no other format is written", text, wanted);
  };
  return CLI::Validator(check, "");
}

void add_world(CLI::App& app, Options& options, bool required) {
  auto* world = app.add_option("WORLD", options.world, "a world file (TOML) or any raster that GDAL opens; default: the embedded Earth");
  world->type_name("");
  if (required) world->required();
}

void add_camera(CLI::App& app, Options& options) {
  add_text(app, "--camera", [&options](const std::string& text) {
    auto pose = view::parse_pose(text);
    if (!pose) throw CLI::ValidationError("--camera", pose.error().message);
    options.camera = *pose;
  }, "where the eye is: degrees, metres above the ellipsoid; heading from north, pitch from the horizon",
           "LAT,LON,HEIGHT[,HEADING[,PITCH[,ROLL]]]");
}

void add_view_options(CLI::App& app, Options& options) {
  globe::ViewSettings& view = options.view;
  add_text(app, "--size", [&options](const std::string& t) { set_size(t, options); }, "picture size in pixels (1280x720)", "WxH");
  app.add_option("--vfov", options.vertical_fov_degrees, "vertical field of view")->check(in_range(0.01, 170.0))->type_name("DEG");
  app.add_option("--sse", view.sse_px, "wanted screen-space error")->check(in_range(0.05, 1000.0))->type_name("PX");
  app.add_option("--exaggeration", view.exaggeration, "vertical exaggeration")->check(in_range(0.0, 1000.0))->type_name("E");
  add_text(app, "--time", [&view](const std::string& text) {
    const auto time = parse_utc(text);
    if (!time) throw CLI::ValidationError("--time", time.error().message);
    view.time = *time;
  }, "the world's time (UTC), sets the sun; without it the light comes from the north-west", "ISO8601");
  add_text(app, "--lod", [&view](const std::string& text) {
    if (text == "sse") view.lod = surface::LodMetric::screen_space_error;
    else if (text == "distance") view.lod = surface::LodMetric::distance;
    else if (text == "solid-angle") view.lod = surface::LodMetric::solid_angle;
    else throw CLI::ValidationError("--lod", fmt::format("\"{}\" is not one of sse, distance, solid-angle", text));
  }, "how levels are chosen", "sse|distance|solid-angle");
  app.add_flag("--no-atmosphere", [&view](std::int64_t) { view.atmosphere = false; }, "no sky and no haze");
  app.add_flag("--no-lighting", [&view](std::int64_t) { view.lighting = false; }, "no sun: the imagery as it is");
  app.add_flag("--wireframe", view.wireframe, "the triangles' edges, coloured by level");
  app.add_flag("--bounds", view.bounds, "the tiles' bounding boxes");
  app.add_flag("--tile-borders", view.tile_borders, "the tiles' borders");
  app.add_flag("--antialias", view.antialiasing, "smooth edges with 4 samples a pixel");
  app.add_option("--anisotropy", view.anisotropy, "of the texture filter")->check(in_range(1.0, 16.0))->type_name("N");
  add_text(app, "--clear", [&view](const std::string& t) { set_colour(t, view.clear); }, "colour of the empty sky (000000)", "RRGGBB");
  add_text(app, "--gl", [&options](const std::string& text) {
    if (text != "core" && text != "es") throw CLI::ValidationError("--gl", fmt::format("\"{}\" is not one of core, es", text));
    options.api = text == "es" ? gpu::Api::es : gpu::Api::core;
  }, "OpenGL 4.1 core or OpenGL ES 3.0", "core|es");
}

void add_resource_options(CLI::App& app, Options& options) {
  app.add_option("--workers", options.workers, "threads that load and build; 0: none (one less than cores; all of them where a picture is waited for)")->check(CLI::Range(0, 256))->type_name("N");
  const auto megabytes = [&app](const std::string& name, std::size_t& bytes, const std::string& help) {
    app.add_option_function<std::size_t>(name, [&bytes](const std::size_t& mb) { bytes = mb << 20; }, help)
        ->check(CLI::Range(std::size_t{16}, std::size_t{1} << 20))->type_name("MB");
  };
  megabytes("--gpu-cache", options.gpu_cache_bytes, "graphics memory (512)");
  megabytes("--memory-cache", options.memory_cache_bytes, "decoded data in memory (512)");
  add_disk_cache(app, options);
  app.add_flag("--offline", options.offline, "use no network");
}

int report(const Error& error) {
  fmt::print(stderr, "tellurion: {}\n", error.message);
  return kFailed;
}

Result<std::unique_ptr<globe::Globe>> open_globe(const Options& options, RenderThreadUse use) {
  auto world = globe::resolve_world(options.world);
  if (!world) return world.error();
  globe::GlobeOptions globe_options;
  globe_options.memory_cache_bytes = options.memory_cache_bytes;
  globe_options.workers = options.workers;
  // While the render thread waits for a finished picture, its core is the workers' too.
  if (options.workers < 0 && use == RenderThreadUse::waits) globe_options.workers = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  globe_options.cache_folder = options.disk_cache;
  globe_options.disk_cache_bytes = options.disk_cache_bytes;
  globe_options.offline = options.offline;
  globe_options.time = options.view.time;
  auto globe = globe::Globe::open(std::move(*world), globe_options);
  if (globe) {
    for (const std::string& hint : (*globe)->hints()) fmt::print(stderr, "tellurion: {}\n", hint);
  }
  return globe;
}

void GroundWarning::check(const geo::Geodetic& eye, double exaggeration) {
  if (!sampler_) {
    auto opened = globe_->height_sampler();
    if (!opened) return;
    sampler_.emplace(std::move(*opened));
  }
  constexpr double kShareOfHeight = 0.01;  // finer data would have to be fetched for nothing
  const Metres spacing(kShareOfHeight * std::max(eye.height.value, 0.0));
  const auto ground = sampler_->height_at(geo::place_of(eye), globe::HeightLookup::bilinear, spacing);
  if (!ground || eye.height.value >= exaggeration * ground->height.value) return;
  fmt::print(stderr, "tellurion: the camera, {:.0f} m above the ellipsoid, is below the ground at {:.0f} m{}: heights of cameras do not count from the ground\n",
             eye.height.value, exaggeration * ground->height.value, exaggeration != 1.0 ? " (exaggerated)" : "");
  sampler_.reset();  // once is enough
}

view::Pose camera_or_home(const Options& options, globe::Globe& globe, std::chrono::milliseconds patience) {
  if (options.camera) return *options.camera;
  (void)globe.wait_for_catalogues(std::chrono::steady_clock::now() + patience);
  return globe.home();  // may wait for the network
}

Result<void> write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush())
    return Error{ErrorCode::unavailable, fmt::format("{}: cannot be written; is the folder there and writable?", file.string())};
  return {};
}

}  // namespace tellurion::apps
