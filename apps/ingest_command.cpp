// tellurion ingest: rasters of any size made ready to be shown.
#include "commands.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <csignal>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "options.h"
#include "prepare/ingest.h"
#include "progress_line.h"

namespace tellurion::apps {
namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t g_interrupted = 0;  // a signal handler reaches nothing else

void stop_on_interrupt() {
  std::signal(SIGINT, [](int) {
    g_interrupted = 1;
    std::signal(SIGINT, SIG_DFL);
  });
}

double megabytes(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

void print_report(const prepare::IngestReport& report, const std::filesystem::path& out, double seconds) {
  if (report.measured) fmt::print("{}.errors: the error table\n", out.string());
  if (report.joined) {
    fmt::print("{}: {} x {} pixels, {} levels, {:.1f} MB; {} of {} chunks made in {:.1f} s\n", out.string(), report.width, report.height, report.levels, megabytes(report.file_bytes),
               report.chunks_made, report.chunks, seconds);
  } else {
    fmt::print("{}: up to date; {} x {} pixels, {} levels, {:.1f} MB\n", out.string(), report.width, report.height, report.levels, megabytes(report.file_bytes));
  }
}

/// Shows progress; ends the work when the user asks for it.
prepare::IngestWatch watch_from(Clock::time_point start) {
  return [start, line = std::shared_ptr<ProgressLine>(), measures = false](const prepare::IngestProgress& progress) mutable {
    constexpr double kPixelsOfUnit = 1e6;
    if (!line || measures != progress.measures) {
      stop_on_interrupt();
      measures = progress.measures;
      line = std::make_shared<ProgressLine>(static_cast<double>(progress.all_pixels) / kPixelsOfUnit, measures ? "megapixels measured" : "megapixels", measures ? Clock::now() : start);
    }
    line->show(static_cast<double>(progress.pixels) / kPixelsOfUnit, static_cast<double>(progress.bytes), progress.pixels == progress.all_pixels);
    return g_interrupted == 0;
  };
}

int run_ingest(const prepare::IngestOptions& options, bool remove_work) {
  stop_on_interrupt();
  const auto start = Clock::now();
  const auto report = prepare::ingest(options, watch_from(start));
  if (!report) return apps::report(report.error());
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  if (options.shards > 1) {
    fmt::print("{}: shard {}/{}, {} of {} chunks made in {:.1f} s\n", prepare::work_folder(options.out).string(), options.shard + 1, options.shards, report->chunks_made, report->chunks, seconds);
    return kDone;
  }
  print_report(*report, options.out, seconds);
  if (remove_work) {
    std::error_code ignored;
    std::filesystem::remove_all(prepare::work_folder(options.out), ignored);
  }
  return kDone;
}

int run_merge(const prepare::MergeOptions& options) {
  const auto start = Clock::now();
  const auto report = prepare::merge(options, watch_from(start));
  if (!report) return apps::report(report.error());
  print_report(*report, options.out, std::chrono::duration<double>(Clock::now() - start).count());
  return kDone;
}

void set_shard(const std::string& text, prepare::IngestOptions& options) {
  const std::vector<std::string> parts = CLI::detail::split(text, '/');
  int number = 0, count = 0;
  const bool good = parts.size() == 2 && CLI::detail::lexical_cast(parts[0], number) && CLI::detail::lexical_cast(parts[1], count) && number >= 1 && number <= count && count <= 100000;
  if (!good) throw CLI::ValidationError("--shard", fmt::format("\"{}\" is not N/COUNT, from 1/COUNT to COUNT/COUNT", text));
  options.shard = number - 1;
  options.shards = count;
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

/// One of several words, whatever its case.
std::string one_of(const char* option, const std::string& text, const std::vector<std::string>& words) {
  const std::string word = lower_case(text);
  if (std::find(words.begin(), words.end(), word) == words.end()) throw CLI::ValidationError(option, fmt::format("\"{}\" is not one of {}", text, CLI::detail::join(words, ", ")));
  return word;
}

int default_workers() { return static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u)); }

void add_work_options(CLI::App& command, int& workers, std::size_t& memory_bytes, std::optional<bool>& error_table) {
  command.add_option("--workers", workers, "threads (all cores)")->check(CLI::Range(1, 256))->type_name("N");
  command.add_option_function<std::size_t>("--memory", [&memory_bytes](const std::size_t& mb) { memory_bytes = mb << 20; }, "bound of the memory used (1024)")
      ->check(CLI::Range(std::size_t{64}, std::size_t{1} << 20))->type_name("MB");
  command.add_option_function<std::string>("--error-table", [&error_table](const std::string& text) {
    const std::string word = one_of("--error-table", text, {"auto", "yes", "no"});
    error_table = word == "auto" ? std::nullopt : std::optional(word == "yes");
  }, "measure how far coarse heights are from these, and write it as FILE.tif.errors (auto: of more than 100 million)")->type_name("auto|yes|no");
}

void add_merge(CLI::App& ingest, Run& run) {
  auto options = std::make_shared<prepare::MergeOptions>();
  options->workers = default_workers();
  CLI::App* command = ingest.add_subcommand("merge", "join what the shards have made");
  command->add_option("WORK", options->folders, "the folders of work of the shards (FILE.tif.work)")->type_name("");
  command->add_option("--out", options->out, "the GeoTIFF to write")->required()->check(has_ending(".tif"))->type_name("FILE.tif");
  add_work_options(*command, options->workers, options->memory_bytes, options->error_table);
  command->callback([options, &run] { run = [options] { return run_merge(*options); }; });
}

void add_format_options(CLI::App& command, prepare::IngestOptions& options) {
  const auto add_word = [&command](const char* name, std::vector<std::string> words, auto take, const char* help) {
    command.add_option_function<std::string>(name, [name, words, take](const std::string& text) { take(one_of(name, text, words)); }, help)->type_name(CLI::detail::join(words, "|"));
  };
  add_word("--kind", {"height", "picture"}, [&options](const std::string& word) { options.kind = word == "height" ? prepare::IngestKind::height : prepare::IngestKind::picture; },
           "what the inputs are (told from their bands)");
  command.add_option_function<std::string>("--crs", [&options](const std::string& t) { options.crs = t; }, "coordinate system of the output (the first input's)")->type_name("CRS");
  command.add_option_function<double>("--resolution", [&options](const double& r) { options.resolution = r; }, "pixel size in units of the CRS (the finest input's)")
      ->check(in_range(1e-12, 1e12))->type_name("SIZE");
  add_word("--resampling", {"near", "bilinear", "cubic", "cubicspline", "lanczos", "average"}, [&options](const std::string& word) { options.resampling = word; }, "where grids differ (bilinear)");
  command.add_option_function<double>("--no-data", [&options](const double& v) { options.no_data = v; }, "the value that means no data in the inputs (their own)")->type_name("VALUE");
  command.add_option_function<std::string>("--vertical", [&options](const std::string& t) { options.vertical = t; }, "what the heights are above: ellipsoid, egm96 or a vertical CRS (what the inputs say)")
      ->type_name("DATUM");
  add_word("--compress", {"deflate", "zstd", "jpeg", "webp", "none"}, [&options](const std::string& word) { options.compress = upper_case(word); },
           "of blocks (deflate; pictures jpeg, with transparency webp)");
  command.add_option("--level", options.level, "of deflate (1 to 12) and zstd (1 to 22): 6")->check(CLI::Range(1, 22))->type_name("N");
  command.add_option("--quality", options.quality, "of jpeg and webp (85); webp of 100 is lossless")->check(CLI::Range(1, 100))->type_name("N");
  command.add_option_function<std::string>("--block", [&options](const std::string& t) { options.block = one_of("--block", t, {"256", "512"}) == "256" ? 256 : 512; }, "side of blocks in pixels (512)")->type_name("256|512");
}

void add_repair_options(CLI::App& command, prepare::RepairOptions& repair) {
  command.add_option("--fill-voids", repair.fill_voids, "fill voids of heights that are at most so many pixels wide and high")->check(CLI::Range(1, 1024))->type_name("PIXELS");
  CLI::Option* base = command.add_option_function<std::string>("--fill-from", [&repair](const std::string& t) { repair.fill_from = t; }, "take what is missing from this raster, fitted to its surroundings in colour or height");
  base->type_name("FILE");
  command.add_option_function<double>("--clouds", [&repair](const double& b) { repair.clouds = b; }, "take what all colours show brighter than --fill-from by more than this (30, say) from there too")
      ->check(in_range(1.0, 65535.0))->needs(base)->type_name("BRIGHTER");
  CLI::Option* coast = command.add_option_function<std::string>("--coast", [&repair](const std::string& t) { repair.coasts.push_back(t); }, "a file of polygons of land (Shapefile, GeoPackage, GeoJSON) or GMT's GSHHG (binned_GSHHS_*.nc); may be repeated");
  CLI::Option* beyond = command.add_option("--sea-beyond", repair.sea_beyond, "cut away the sea that is farther than this off the coast")->check(in_range(0.0, 2e7));
  coast->needs(beyond)->trigger_on_parse()->type_name("FILE");
  beyond->needs(coast)->type_name("METRES");
}

}  // namespace

void add_ingest(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("ingest", "prepare rasters: one Cloud Optimized GeoTIFF with overviews of any number of them");
  struct All {
    prepare::IngestOptions ingest;
    bool remove_work = false;
  };
  auto all = std::make_shared<All>();
  prepare::IngestOptions& options = all->ingest;
  options.workers = default_workers();
  command->require_subcommand(0, 1);
  command->add_option("INPUT", options.inputs, "rasters that GDAL opens, and folders of them")->type_name("");
  command->add_option("--out", options.out, "the GeoTIFF to write; FILE.tif.work keeps what is done")->check(has_ending(".tif"))->type_name("FILE.tif");
  add_format_options(*command, options);
  add_repair_options(*command, options.repair);
  add_work_options(*command, options.workers, options.memory_bytes, options.error_table);
  command->add_option_function<std::string>("--shard", [&options](const std::string& t) { set_shard(t, options); }, "make this share of the chunks and join nothing")->type_name("N/COUNT");
  command->add_flag("--remove-work", all->remove_work, "remove FILE.tif.work at the end; without it a change of an input later costs only what it touches");
  add_merge(*command, run);
  command->callback([command, all, &run] {
    if (!command->get_subcommands().empty()) return;  // merge has its own
    if (all->ingest.inputs.empty()) throw CLI::RequiredError("INPUT");
    if (all->ingest.out.empty()) throw CLI::RequiredError("--out");
    if (all->ingest.compress != "ZSTD" && all->ingest.level > 12) throw CLI::ValidationError("--level", "deflate has levels 1 to 12");
    if (all->ingest.shards > 1 && all->remove_work) throw CLI::ValidationError("--remove-work", "a shard leaves its work for `ingest merge`");
    run = [all] { return run_ingest(all->ingest, all->remove_work); };
  });
}

}  // namespace tellurion::apps
