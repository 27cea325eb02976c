// tellurion cache prefetch: what a region or a flight needs of servers, fetched ahead.
#include "commands.h"

#include <array>
#include <chrono>
#include <csignal>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "flight_frames.h"
#include "progress_line.h"

namespace tellurion::apps {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kTypicalTileBytes = 20e3;  ///< of 256 x 256 pixels, where the cache does not know better
constexpr std::int64_t kKnownTiles = 20;    ///< in the cache, for it to know
constexpr std::int64_t kMostNotKept = 16;   ///< files that the cache does not take, before no more are fetched

struct PrefetchOptions : FlightOptions {
  globe::PrefetchArea area;
  bool has_bounds = false;
  bool has_levels = false;
  bool anyway = false;
  std::vector<const CLI::Option*> of_flights;  ///< those that say nothing of a region
};

volatile std::sig_atomic_t g_interrupted = 0;  // a signal handler reaches nothing else

/// Ctrl-C ends the work in an orderly way, the second one at once.
void stop_on_interrupt() {
  std::signal(SIGINT, [](int) {
    g_interrupted = 1;
    std::signal(SIGINT, SIG_DFL);
  });
}

std::string megabytes(double bytes) { return fmt::format("{:.1f} MB", bytes / (1 << 20)); }

/// Whether there is a point in fetching more: what is not kept is of no use.
bool may_go_on(const globe::Globe& globe) { return g_interrupted == 0 && globe.fetch_stats().not_kept < kMostNotKept; }

int ended(const std::filesystem::path& folder, std::int64_t not_kept, bool stopped, std::int64_t done, std::int64_t count, std::int64_t missing, const char* unit,
          const std::string& last_error) {
  if (not_kept > 0) {
    return report({ErrorCode::unavailable, fmt::format("{} files came and could not be kept in {}; is it writable, is there room on the disk, and is its bound "
                                                       "(--disk-cache DIR,MB) large enough?", not_kept, folder.string())});
  }
  if (stopped) {
    fmt::print(stderr, "tellurion: stopped after {} of {} {}: the same command goes on from there\n", done, count, unit);
    return kFailed;
  }
  if (missing == 0) return kDone;
  fmt::print(stderr, "tellurion: {} of {} {} could not be had{}{}; the same command tries them again\n", missing, count, unit,
             last_error.empty() ? "" : "; the last: ", last_error);
  return kDataMissing;
}

/// What a tile of 256 pixels takes on average.
double bytes_per_tile(const std::filesystem::path& folder) {
  const auto kept = globe::kept_files(folder);
  const std::int64_t files = kept ? kept->files - kept->missing : 0;
  return files >= kKnownTiles ? static_cast<double>(kept->file_bytes) / static_cast<double>(files) : kTypicalTileBytes;
}

void print_parts(const globe::Prefetch& plan) {
  struct Levels {
    int coarsest, finest;
    std::int64_t count;
  };
  std::map<std::string, Levels> layers;
  for (const auto& part : plan.parts()) {
    Levels& levels = layers.try_emplace(part.layer, Levels{part.zoom, part.zoom, 0}).first->second;
    levels.coarsest = std::min(levels.coarsest, part.zoom);
    levels.finest = std::max(levels.finest, part.zoom);
    levels.count += part.count();
  }
  for (const auto& [name, levels] : layers) fmt::print("{}: levels {} to {}, {} tiles\n", name, levels.coarsest, levels.finest, levels.count);
}

int prefetch_region(const PrefetchOptions& options, globe::Globe& globe) {
  auto plan = globe::Prefetch::plan(globe, options.area);
  if (!plan) return report(plan.error());
  const std::int64_t count = plan->count();
  const double bytes = plan->estimated_bytes(bytes_per_tile(options.disk_cache));
  print_parts(*plan);
  fmt::print("{} tiles, about {}; {} holds up to {}\n", count, megabytes(bytes), options.disk_cache.string(), megabytes(static_cast<double>(options.disk_cache_bytes)));
  std::fflush(stdout);
  if (bytes > static_cast<double>(options.disk_cache_bytes) && !options.anyway) {
    return report({ErrorCode::exhausted, fmt::format("the tiles would not fit: --disk-cache {},{:.0f} makes room, a smaller region or coarser levels need less, "
                                                     "--anyway fetches them nevertheless", options.disk_cache.string(), std::ceil(1.2 * bytes / (1 << 20)))});
  }
  ProgressLine line(static_cast<double>(count), "tiles");
  const auto progress = plan->run([&](const globe::PrefetchProgress& p) {
    line.show(static_cast<double>(p.done + p.failed), static_cast<double>(globe.fetch_stats().bytes));
    return may_go_on(globe);
  });
  line.show(static_cast<double>(progress.done + progress.failed), static_cast<double>(globe.fetch_stats().bytes), true);
  return ended(options.disk_cache, globe.fetch_stats().not_kept, progress.stopped, progress.done, count, count - progress.done, "tiles", progress.last_error);
}

/// Loads every frame as `fly` would, without drawing it.
int prefetch_flight(const PrefetchOptions& options, globe::Globe& globe) {
  auto flight = view::read_flight(options.flight);
  if (!flight) return report(flight.error());
  auto thread = gpu::RenderThread::headless(options.api);
  if (!thread) return report(thread.error());
  auto view = globe::GlobeView::create(globe, **thread, options.gpu_cache_bytes);
  if (!view) return report(view.error());
  const int count = frame_count(*flight, options);
  ProgressLine line(count, "frames");
  int frame = 0, incomplete = 0;
  for (; frame < count && may_go_on(globe); ++frame) {
    const auto deadline = Clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout_seconds * 1e3));
    if (!(*view)->finish(frame_camera(*flight, frame, options, globe.ellipsoid()), frame_settings(frame, options), deadline)) ++incomplete;
    line.show(frame + 1, static_cast<double>(globe.fetch_stats().bytes), frame + 1 == count);
  }
  std::string last_error;
  for (const auto& source : globe.source_stats()) {
    if (!source.last_error.empty()) last_error = source.last_error;
  }
  return ended(options.disk_cache, globe.fetch_stats().not_kept, frame < count, frame, count, incomplete, "frames", last_error);
}

int prefetch(const PrefetchOptions& options) {
  if (options.disk_cache.empty()) return report({ErrorCode::invalid_argument, "there is no folder to keep tiles in: say --disk-cache DIR"});
  stop_on_interrupt();
  auto globe = open_globe(options, RenderThreadUse::waits);
  if (!globe) return report(globe.error());
  bool remote = false;
  for (std::size_t i = 0; i < (*globe)->layer_count(); ++i) {
    const auto& raster = (*globe)->layer(i).raster;
    remote = remote || (raster && raster->description().is_remote);
  }
  if (!remote) {
    const bool missing = (*globe)->data_missing();
    fmt::print("no layer of this world {}comes over a network\n", missing ? "that could be opened " : "");
    return missing ? kDataMissing : kDone;
  }
  const int status = options.flight.empty() ? prefetch_region(options, **globe) : prefetch_flight(options, **globe);
  if (status != kDone || !(*globe)->data_missing()) return status;
  fmt::print(stderr, "tellurion: of other layers, which could not be opened or read, nothing is kept\n");
  return kDataMissing;
}

void set_bounds(const std::string& text, PrefetchOptions& options) {
  std::vector<std::string> parts = CLI::detail::split(text, ',');
  bool good = parts.size() == 4;
  std::array<double, 4> edges{};
  for (std::size_t i = 0; good && i < 4; ++i) good = CLI::detail::lexical_cast(parts[i], edges[i]) && std::abs(edges[i]) <= (i % 2 == 0 ? 180.0 : 90.0);
  if (!good || edges[0] == edges[2] || edges[1] >= edges[3])
    throw CLI::ValidationError("--bounds", fmt::format("\"{}\" is not WEST,SOUTH,EAST,NORTH in degrees, south < north", text));
  options.area.bounds = edges;
  options.has_bounds = true;
}

void set_levels(const std::string& text, PrefetchOptions& options) {
  const std::vector<std::string> parts = CLI::detail::split(text, '-');
  std::array<int, 2> zooms{};
  bool good = parts.size() == 2;
  for (std::size_t i = 0; good && i < 2; ++i) good = CLI::detail::lexical_cast(parts[i], zooms[i]) && zooms[i] >= 0 && zooms[i] <= 30;
  if (!good || zooms[0] > zooms[1]) throw CLI::ValidationError("--levels", fmt::format("\"{}\" is not COARSEST-FINEST, for example 0-12", text));
  options.area.zooms = {zooms[0], zooms[1]};
  options.has_levels = true;
}

/// A region or a flight, with what each needs.
void check(const PrefetchOptions& options) {
  const bool flight = !options.flight.empty(), levels = options.has_levels, resolution = options.area.metres_per_pixel.has_value();
  if (flight && (options.has_bounds || levels || resolution)) throw CLI::ValidationError("--flight", "a flight says itself what it needs: it goes without --bounds, --levels and --resolution");
  if (!flight && (!options.has_bounds || levels == resolution))
    throw CLI::ValidationError("prefetch", "say --bounds W,S,E,N and --levels A-B or --resolution M; or --flight FILE.csv");
  if (!flight) {
    for (const CLI::Option* option : options.of_flights) {
      if (option->count() > 0) throw CLI::ValidationError(option->get_name(), "is an option of flights: it goes with --flight, not with --bounds");
    }
  }
  if (options.offline) throw CLI::ValidationError("--offline", "there is nothing to fetch without a network");
}

}  // namespace

void add_prefetch(CLI::App& cache, Run& run) {
  auto options = std::make_shared<PrefetchOptions>();
  CLI::App* command = cache.add_subcommand("prefetch", "fetch the tiles of a region or a flight ahead, for --offline");
  add_world(*command, *options, true);
  add_flight_options(*command, *options);
  add_view_options(*command, *options);
  command->remove_option(command->get_option("--bounds"));  // of tiles: nothing is drawn here, and the region has that name
  for (const CLI::Option* option : command->get_options([&](const CLI::Option* one) { return !one->get_lnames().empty() && one != command->get_help_ptr(); })) {
    if (option->get_name() != "--time") options->of_flights.push_back(option);  // a region of layers with times is fetched at one
  }
  add_resource_options(*command, *options);
  command->add_option_function<std::string>("--bounds", [options](const std::string& t) { set_bounds(t, *options); }, "the region, in degrees; west > east: across longitude 180")->type_name("W,S,E,N");
  command->add_option_function<std::string>("--levels", [options](const std::string& t) { set_levels(t, *options); }, "the levels: zooms, the coarsest and the finest")->type_name("A-B");
  command->add_option_function<double>("--resolution", [options](const double& metres) { options->area = {options->area.bounds, {0, 30}, metres, {}}; },
                                       "instead: every level down to this fineness, metres a pixel")->check(in_range(1e-3, 1e7))->type_name("M");
  command->add_option("--flight", options->flight, "instead of a region: what `fly` needs for this flight, with the same options")->type_name("FILE.csv");
  command->add_flag("--anyway", options->anyway, "even if the tiles will not fit into the disk cache");
  command->callback([options, &run] {
    check(*options);
    options->area.time = options->view.time;
    run = [options] { return prefetch(*options); };
  });
}

}  // namespace tellurion::apps
