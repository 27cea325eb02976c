// tellurion fly: a recorded flight, as pictures or a video.
#include "commands.h"

#include <chrono>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "flight_frames.h"
#include "timed_frames.h"

namespace tellurion::apps {
namespace {

using Clock = std::chrono::steady_clock;

struct FlyOptions : FlightOptions {
  bool realtime = false;
};

/// Where a flight's pictures go: numbered PNGs in a folder, one video, or nowhere.
class PictureSink {
 public:
  static Result<PictureSink> open(const FlyOptions& options) {
    PictureSink sink;
    if (options.out.empty()) return sink;
    if (options.out.extension() == ".mp4") {
      const auto folder = options.out.parent_path();
      if (!folder.empty() && !std::filesystem::is_directory(folder))
        return Error{ErrorCode::not_found, fmt::format("--out {}: there is no folder {}", options.out.string(), folder.string())};
      auto video = globe::VideoWriter::open(options.out, options.width, options.height, options.frames_per_second);
      if (!video) return video.error();
      sink.video_ = std::move(*video);
      return sink;
    }
    const bool is_folder = std::filesystem::is_directory(options.out);
    if (options.out.has_extension() && !is_folder)
      return Error{ErrorCode::invalid_argument, fmt::format("--out {}: a video is a FILE.mp4, pictures go into a folder without an ending", options.out.string())};
    std::error_code failure;
    std::filesystem::create_directories(options.out, failure);
    if (failure) return Error{ErrorCode::unavailable, fmt::format("{}: {}", options.out.string(), failure.message())};
    sink.folder_ = options.out;
    return sink;
  }

  bool takes_pictures() const { return video_ || !folder_.empty(); }

  Result<void> add(const raster::Image& image, int frame) {
    return video_ ? video_->add(image) : globe::write_png(folder_ / fmt::format("{:06}.png", frame), image);
  }

  Result<void> close() { return video_ ? video_->close() : Result<void>(); }

 private:
  std::unique_ptr<globe::VideoWriter> video_;
  std::filesystem::path folder_;
};

void show_progress(int frame, int count) {
  if (!isatty(STDERR_FILENO)) return;
  const int done = 40 * frame / std::max(count, 1);
  fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {}/{}", "", done, "", 40 - done, frame, count);
  if (frame == count) fmt::print(stderr, "\n");
}

/// Larger blocks of memory go back to the system at once. Else a software rasteriser's for a frame and those of the workers stay
/// in the allocator's pools; a flight that writes pictures can spare the time that mapping takes.
void keep_memory_flat() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 64 << 10);
  mallopt(M_ARENA_MAX, 2);
#endif
}

/// The same for smaller ones: what loading has left, before the picture is drawn.
void give_memory_back() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

int fly(const FlyOptions& options) {
  if (!options.realtime) keep_memory_flat();
  auto flight = view::read_flight(options.flight);
  if (!flight) return report(flight.error());
  auto thread = gpu::RenderThread::headless(options.api);
  if (!thread) return report(thread.error());
  auto globe = open_globe(options, options.realtime ? RenderThreadUse::draws : RenderThreadUse::waits);
  if (!globe) return report(globe.error());
  auto view = globe::GlobeView::create(**globe, **thread, options.gpu_cache_bytes);
  if (!view) return report(view.error());
  auto sink = PictureSink::open(options);
  if (!sink) return report(sink.error());

  GroundWarning ground(**globe);
  TimedFrames frames(**view);
  globe::SummaryStats summary;
  std::string trace = globe::trace_header();
  bool complete = true;
  const int count = frame_count(*flight, options);
  const auto start = Clock::now();
  for (int frame = 0; frame < count; ++frame) {
    const double elapsed = frame_seconds(frame, options);
    if (options.realtime) {
      // The flight's clock is the wall clock: slow frames are dropped, fast ones wait.
      const double now = std::chrono::duration<double>(Clock::now() - start).count();
      if (now > elapsed + 1.0 / options.frames_per_second && frame + 1 < count) continue;
      if (now < elapsed) std::this_thread::sleep_for(std::chrono::duration<double>(elapsed - now));
    }
    const view::Camera camera = frame_camera(*flight, frame, options, (*globe)->ellipsoid());
    globe::ViewSettings settings = frame_settings(frame, options);
    settings.transitions = options.realtime;
    if (!options.realtime) {
      const auto deadline = Clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout_seconds * 1e3));
      const bool finished = (*view)->finish(camera, settings, deadline);
      complete &= finished;
      if (finished) ground.check(flight->pose_at(flight->start_s() + elapsed).position, options.view.exaggeration);  // by data that the picture has brought
      give_memory_back();
    }
    globe::FrameStats stats = frames.draw(camera, settings);
    stats.frame = frame;
    stats.time = elapsed;
    stats.resident_bytes = globe::resident_bytes();
    summary.frame_ms.push_back(stats.frame_ms);
    summary.last = stats;
    if (!options.trace_file.empty()) trace += globe::trace_line(stats);
    if (sink->takes_pictures()) {
      if (const auto added = sink->add((*view)->last_picture(), frame); !added) return report(added.error());
    }
    show_progress(frame + 1, count);
  }
  summary.load_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  summary.sources = (*globe)->source_stats();
  if (const auto closed = sink->close(); !closed) return report(closed.error());
  if (!options.stats_file.empty()) {
    if (const auto written = write_text(options.stats_file, globe::to_json(summary)); !written) return report(written.error());
  }
  if (!options.trace_file.empty()) {
    if (const auto written = write_text(options.trace_file, trace); !written) return report(written.error());
  }
  if (!complete || (*globe)->data_missing()) {
    fmt::print(stderr, "tellurion: {}, but some frames lack data\n", options.out.empty() ? "the figures are written" : options.out.string() + " is written");
    return kDataMissing;
  }
  return kDone;
}

}  // namespace

void add_fly(CLI::App& app, Run& run) {
  auto options = std::make_shared<FlyOptions>();
  CLI::App* command = app.add_subcommand("fly", "a flight as pictures or a video, every frame finished");
  // One or two words: the flight, or the world and the flight.
  auto words = std::make_shared<std::vector<std::string>>();
  command->add_option("WORLD FLIGHT", *words, "the world (default: the embedded Earth) and the flight: a CSV with the header "
                      "time,lat,lon,height,heading,pitch,roll")->required()->expected(1, 2)->type_name("");
  command->add_option("--out", options->out, "a folder for numbered PNGs, or a video; may be left out if figures are written")->type_name("DIR|FILE.mp4");
  command->add_flag("--realtime", options->realtime, "by the wall clock, finished or not");
  add_flight_options(*command, *options);
  command->add_option("--stats", options->stats_file, "write the flight's figures")->type_name("FILE.json");
  command->add_option("--trace", options->trace_file, "write the figures of every frame")->type_name("FILE.csv");
  add_view_options(*command, *options);
  add_resource_options(*command, *options);
  command->callback([options, words, &run] {
    options->flight = words->back();
    if (words->size() == 2) options->world = words->front();
    if (options->out.empty() && options->stats_file.empty() && options->trace_file.empty())
      throw CLI::RequiredError("--out, or --stats or --trace for the figures alone");
    run = [options] { return fly(*options); };
  });
}

}  // namespace tellurion::apps
