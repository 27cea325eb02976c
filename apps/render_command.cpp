// tellurion render: one finished picture, headless.
#include "commands.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "options.h"
#include "timed_frames.h"

namespace tellurion::apps {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTimedFrames = 20;

Clock::duration milliseconds(double ms) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(ms));
}

/// Draws the view for `ms`, loading as a viewer would.
void draw_for(TimedFrames& frames, const view::Camera& camera, const globe::ViewSettings& settings, double ms, std::string* trace) {
  const auto deadline = Clock::now() + milliseconds(ms);
  do {
    const globe::FrameStats stats = frames.draw(camera, settings);
    if (trace) *trace += globe::trace_line(stats);
  } while (Clock::now() < deadline);
}

int render(const Options& options) {
  auto thread = gpu::RenderThread::headless(options.api);
  if (!thread) return report(thread.error());
  auto globe = open_globe(options, options.after_ms ? RenderThreadUse::draws : RenderThreadUse::waits);
  if (!globe) return report(globe.error());
  const auto start = Clock::now();  // the view's coarsest tiles may come over a network
  auto view = globe::GlobeView::create(**globe, **thread, options.gpu_cache_bytes);
  if (!view) return report(view.error());

  const view::Pose pose = camera_or_home(options, **globe, std::chrono::milliseconds(static_cast<std::int64_t>(options.after_ms ? 0 : options.timeout_seconds * 1e3)));
  const auto camera = view::make_camera((*globe)->ellipsoid(), pose,
                                        to_radians(Degrees(options.vertical_fov_degrees)), options.width, options.height);
  std::string trace = globe::trace_header();
  TimedFrames frames(**view);
  bool complete = true;
  bool out_of_time = false;
  if (options.after_ms) {
    draw_for(frames, camera, options.view, *options.after_ms, &trace);
  } else {
    const auto deadline = start + milliseconds(options.timeout_seconds * 1e3);
    complete = (*view)->finish(camera, options.view, deadline);
    out_of_time = !complete && Clock::now() >= deadline;
  }
  globe::SummaryStats summary;
  summary.load_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  if (complete && !options.after_ms) GroundWarning(**globe).check(pose.position, options.view.exaggeration);  // by data that the picture has brought

  const raster::Image picture = (*view)->picture(camera, options.view);
  if (const auto written = globe::write_png(options.out, picture); !written) return report(written.error());
  if (!options.geo_file.empty()) {
    if (const auto written = globe::write_geo_tiff(options.geo_file, (*view)->measure(camera, options.view)); !written)
      return report(written.error());
  }
  if (!options.stats_file.empty() || !options.trace_file.empty()) {
    for (int i = 0; i < kTimedFrames; ++i) {
      summary.last = frames.draw(camera, options.view);
      summary.frame_ms.push_back(summary.last.frame_ms);
      trace += globe::trace_line(summary.last);
    }
    summary.last.resident_bytes = globe::resident_bytes();
    summary.sources = (*globe)->source_stats();
    if (!options.stats_file.empty()) {
      if (const auto written = write_text(options.stats_file, globe::to_json(summary)); !written) return report(written.error());
    }
    if (!options.trace_file.empty()) {
      if (const auto written = write_text(options.trace_file, trace); !written) return report(written.error());
    }
  }
  if (options.after_ms) return (*globe)->data_missing() ? kDataMissing : kDone;
  if (!complete || (*globe)->data_missing()) {
    auto told = (*globe)->hints();  // printed when the world was opened
    for (const std::string& problem : (*globe)->problems()) {
      fmt::print(stderr, "tellurion: {}\n", problem);
      told.push_back(problem);
    }
    const auto is_known = [&](const std::string& error) { return std::find(told.begin(), told.end(), error) != told.end(); };
    for (const auto& source : (*globe)->source_stats())
      if (!source.last_error.empty() && !is_known(source.last_error)) fmt::print(stderr, "tellurion: {}\n", source.last_error);
    fmt::print(stderr, "tellurion: {} is written, but {}\n", options.out.string(),
               out_of_time ? "it is not complete: --timeout gives it more time" : "some data could not be read");
    return kDataMissing;
  }
  return kDone;
}

}  // namespace

void add_render(CLI::App& app, Run& run) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("render", "one finished picture, headless");
  add_world(*command, *options, false);
  command->add_option("--out", options->out, "the PNG to write")->required()->check(has_ending(".png"))->type_name("FILE.png");
  add_camera(*command, *options);
  add_view_options(*command, *options);
  add_resource_options(*command, *options);
  command->add_option("--timeout", options->timeout_seconds, "give up loading after this time (120)")->check(in_range(0.0, 1e6))->type_name("S");
  command->add_option("--after", options->after_ms, "the picture as it is after this time, loading or not")->check(in_range(0.0, 1e9))->type_name("MS");
  command->add_option("--stats", options->stats_file, "write the picture's figures")->type_name("FILE.json");
  command->add_option("--trace", options->trace_file, "write the figures of every frame")->type_name("FILE.csv");
  command->add_option("--geo", options->geo_file, "write what the picture shows: latitude, longitude, height, distance")->type_name("FILE.tif");
  command->callback([options, &run] { run = [options] { return render(*options); }; });
}

}  // namespace tellurion::apps
