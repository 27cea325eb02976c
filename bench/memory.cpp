// What a long flight with small caches takes: the program itself, by its own trace.
#include <charconv>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "bench/child_process.h"
#include "bench/groups.h"
#include "bench/scene.h"
#include "view/flight.h"

namespace tellurion::bench {
namespace {

constexpr double kMegabyte = 1 << 20;
constexpr double kCacheMegabytes = 128;
constexpr double kLargestTileMegabytes = 4;

/// Five minutes: low over two mountains, far over the oceans, across both poles.
Result<void> write_flight(const std::filesystem::path& file) {
  const view::FlightSample samples[] = {
      {0, pose_at(46.60, -121.76, 8e3, 0, -15)},      {30, pose_at(47.50, -121.70, 30e3, 10, -30)},
      {60, pose_at(89.90, -60.0, 900e3, 90, -60)},    {100, pose_at(50.0, 10.0, 3e6, 120, -70)},
      {130, pose_at(28.5, 84.0, 100e3, 110, -25)},    {150, pose_at(27.7, 86.9, 12e3, 20, -15)},
      {170, pose_at(27.9, 87.5, 15e3, 80, -20)},      {200, pose_at(-30.0, 140.0, 2e6, 150, -60)},
      {230, pose_at(-89.9, 170.0, 600e3, 90, -50)},   {260, pose_at(-20.0, -120.0, 6e6, 300, -80)},
      {300, pose_at(46.70, -121.76, 6500, 360, -10)}};
  return view::write_flight(file, samples);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    cells.push_back(line.substr(at, end - at));
    at = end + 1;
  }
  return cells;
}

/// The largest number in each column of a trace that `names` names. Errors: corrupt.
Result<std::vector<double>> largest_of(const std::filesystem::path& trace, const std::vector<std::string>& names) {
  std::ifstream stream(trace);
  std::string line;
  std::getline(stream, line);
  const auto header = cells_of(line);
  std::vector<std::size_t> columns;
  for (const std::string& name : names) {
    const auto found = std::find(header.begin(), header.end(), name);
    if (found == header.end()) return Error{ErrorCode::corrupt, fmt::format("{}: no column {}", trace.string(), name)};
    columns.push_back(static_cast<std::size_t>(found - header.begin()));
  }
  std::vector<double> largest(names.size(), 0.0);
  while (std::getline(stream, line)) {
    const auto cells = cells_of(line);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      double value = 0.0;
      if (columns[i] >= cells.size() ||
          std::from_chars(cells[columns[i]].data(), cells[columns[i]].data() + cells[columns[i]].size(), value).ec != std::errc())
        return Error{ErrorCode::corrupt, fmt::format("{}: \"{}\"", trace.string(), line)};
      largest[i] = std::max(largest[i], value);
    }
  }
  return largest;
}

Result<void> measure_flight(const Setting& setting, Report& report) {
  auto world = default_world_with(setting, {{globe::LayerGroup::height, kEverest}, {globe::LayerGroup::height, kRainier}, {globe::LayerGroup::color, kLargeBlueMarble}});
  if (!world) return world.error();
  const auto world_file = setting.scratch / "flight.toml", flight_file = setting.scratch / "flight.csv", trace = setting.scratch / "trace.csv";
  if (auto saved = globe::save_world(*world, world_file); !saved) return saved;
  if (auto written = write_flight(flight_file); !written) return written;
  const std::string fps = setting.quick ? "0.2" : "2";
  const auto run = run_program({this_program().string(), "fly", world_file.string(), flight_file.string(), "--out", (setting.scratch / "flight.mp4").string(),
                                "--fps", fps, "--memory-cache", fmt::format("{}", kCacheMegabytes), "--gpu-cache", fmt::format("{}", kCacheMegabytes),
                                "--disk-cache", (setting.scratch / "tables").string(), "--trace", trace.string()});
  if (!run) return run.error();
  const auto largest = largest_of(trace, {"resident_bytes", "memory_cache_bytes", "gpu_cache_bytes"});
  if (!largest) return largest.error();
  const std::string note = fmt::format("{} frames a second of the flight", fps);
  report.set("resident_mb", (*largest)[0] / kMegabyte, note);
  report.set("memory_cache_mb", (*largest)[1] / kMegabyte, note);
  report.set("gpu_cache_mb", (*largest)[2] / kMegabyte, note);
  return {};
}

}  // namespace

std::vector<Benchmark> memory_benchmarks() {
  return {{"memory.flight",
           "the most of any frame of a five-minute flight round the world, 1280x720, --memory-cache 128 --gpu-cache 128, every frame finished",
           {{"resident_mb", "MB", 450.0},
            {"memory_cache_mb", "MB", kCacheMegabytes + kLargestTileMegabytes},
            {"gpu_cache_mb", "MB", kCacheMegabytes + kLargestTileMegabytes}},
           measure_flight}};
}

}  // namespace tellurion::bench
