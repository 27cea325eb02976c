// Preparation beside GDAL's own programs: the same input, in turn.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bench/child_process.h"
#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

constexpr int kSide = 10'000;
constexpr int kQuickSide = 2'000;

using Words = std::vector<std::string>;

/// Seconds of each round.
struct Times {
  std::vector<double> ours, theirs;

  /// How many times as fast we are.
  double ratio() const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < ours.size(); ++i) ratios.push_back(theirs[i] / ours[i]);
    return median(ratios);
  }
};

/// `fresh` is removed before each run.
Result<Times> in_turn(const Words& ours, const Words& theirs, const std::vector<std::filesystem::path>& fresh, int rounds) {
  Times times;
  for (int round = 0; round < rounds; ++round) {
    for (const auto& [words, into] : {std::pair(&ours, &times.ours), {&theirs, &times.theirs}}) {
      for (const auto& path : fresh) std::filesystem::remove_all(path);
      const auto run = run_program(*words);
      if (!run) return run.error();
      into->push_back(run->seconds);
    }
  }
  return times;
}

/// A file of the data, enlarged to side x side pixels. Errors: not_found.
Result<std::string> enlarged(const Setting& setting, const char* from, const char* name, int side, Words more) {
  const auto source = setting.data / from;
  std::error_code failure;
  if (!std::filesystem::exists(source, failure)) return Error{ErrorCode::not_found, fmt::format("{} is missing; --data names the folder of the larger data sets", source.string())};
  const std::string file = (setting.scratch / name).string(), size = fmt::format("{}", side);
  Words words{"gdal_translate", "-q", "-r", "cubic", "-outsize", size, size};
  words.insert(words.end(), more.begin(), more.end());
  words.insert(words.end(), {source.string(), file});
  if (const auto made = run_program(words); !made) return made.error();
  return file;
}

void report_times(const Times& times, int side, double bytes_a_pixel, Report& report) {
  const double megabytes = bytes_a_pixel * side * side / 1e6;
  report.set("speed_ratio", times.ratio(), fmt::format("median of {} rounds in turn, {} x {} samples", times.ours.size(), side, side));
  report.set("mb_s", megabytes / median(times.ours), fmt::format("{:.1f} s", median(times.ours)));
  report.set("gdal_mb_s", megabytes / median(times.theirs), fmt::format("{:.1f} s", median(times.theirs)));
}

Result<void> measure_heights(const Setting& setting, Report& report) {
  const int side = setting.quick ? kQuickSide : kSide;
  const auto dem = enlarged(setting, kRainier, "ingest_dem.tif", side, {"-ot", "Float32"});
  if (!dem) return dem.error();
  const std::string ours = (setting.scratch / "ingest_ours.tif").string(), theirs = (setting.scratch / "ingest_theirs.tif").string();
  const auto times = in_turn({this_program().string(), "ingest", *dem, "--out", ours, "--vertical", "ellipsoid", "--remove-work"},
                             {"gdal_translate", "-q", "-of", "COG", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=YES", "-co", "OVERVIEW_RESAMPLING=AVERAGE", "-co",
                              "NUM_THREADS=ALL_CPUS", *dem, theirs},
                             {ours, ours + ".work", theirs}, setting.quick ? 1 : 3);
  if (!times) return times.error();
  report_times(*times, side, 4, report);
  return {};
}

Result<void> measure_picture(const Setting& setting, Report& report) {
  const int side = setting.quick ? kQuickSide : kSide;
  // In Web Mercator, so that nobody needs to warp it.
  const auto picture = enlarged(setting, kLargeBlueMarble, "ingest_picture.tif", side, {"-a_srs", "EPSG:3857", "-a_ullr", "0", "1000000", "1000000", "0"});
  if (!picture) return picture.error();
  const std::string ours = (setting.scratch / "ingest_ours.tif").string(), tiles = (setting.scratch / "ingest_tiles").string();
  const auto times = in_turn({this_program().string(), "ingest", *picture, "--out", ours, "--remove-work"},
                             {"gdal2tiles.py", "-q", "--processes=2", "-w", "none", *picture, tiles}, {ours, ours + ".work", tiles}, setting.quick ? 1 : 3);
  if (!times) return times.error();
  report_times(*times, side, 3, report);
  return {};
}

}  // namespace

std::vector<Benchmark> ingest_benchmarks() {
  return {{"ingest.heights",
           "tellurion ingest of Float32 heights beside gdal_translate -of COG with the same compression (DEFLATE 6 with predictor), overviews and blocks",
           {{"speed_ratio", "ratio", 1.0, Better::higher}, {"mb_s", "MB/s", {}, Better::higher}, {"gdal_mb_s", "MB/s", {}, Better::higher}},
           measure_heights},
          {"ingest.picture",
           "tellurion ingest of a picture of three colours (JPEG 85) beside gdal2tiles.py with two processes (PNG)",
           {{"speed_ratio", "ratio", 4.0, Better::higher}, {"mb_s", "MB/s", {}, Better::higher}, {"gdal_mb_s", "MB/s", {}, Better::higher}},
           measure_picture}};
}

}  // namespace tellurion::bench
