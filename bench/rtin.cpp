// Decimation of a height grid, against the npm package @mapbox/martini in the same run.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/child_process.h"
#include "bench/groups.h"
#include "bench/statistics.h"
#include "surface/rtin.h"

namespace tellurion::bench {
namespace {

constexpr int kSide = 257;
constexpr float kTolerance = 10.0f;  // metres
constexpr double kRelief = 1000.0;

/// A number in [0, 1] for a lattice point, the same on every machine.
double noise_at(std::uint32_t x, std::uint32_t y, std::uint32_t octave) {
  std::uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca6bu ^ octave * 0xc2b2ae35u;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return static_cast<double>(h ^ (h >> 15)) / 4294967295.0;
}

/// Lattice noise, smoothly interpolated.
double smooth_noise(double x, double y, std::uint32_t octave) {
  const auto column = static_cast<std::uint32_t>(x), row = static_cast<std::uint32_t>(y);
  const double u = x - column, v = y - row;
  const double s = u * u * (3.0 - 2.0 * u), t = v * v * (3.0 - 2.0 * v);
  const double upper = std::lerp(noise_at(column, row, octave), noise_at(column + 1, row, octave), s);
  const double lower = std::lerp(noise_at(column, row + 1, octave), noise_at(column + 1, row + 1, octave), s);
  return std::lerp(upper, lower, t);
}

/// Mountains: seven octaves of noise, scaled to the relief.
std::vector<float> make_terrain() {
  std::vector<double> heights;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      double height = 0.0;
      for (std::uint32_t octave = 0; octave < 7; ++octave) {
        const double cells = std::ldexp(4.0, static_cast<int>(octave)) / kSide;
        height += smooth_noise(x * cells, y * cells, octave) * std::pow(0.512, octave);
      }
      heights.push_back(height);
    }
  }
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  const double base = *lowest, scale = kRelief / (*highest - *lowest);
  std::vector<float> terrain;
  for (const double height : heights) terrain.push_back(static_cast<float>((height - base) * scale));
  return terrain;
}

std::size_t decimate_often(const std::vector<float>& terrain, int count, std::vector<double>& ms) {
  std::size_t triangles = 0;
  for (int i = 0; i < count; ++i) {
    const Stopwatch watch;
    const auto errors = surface::midpoint_errors(terrain, kSide);
    triangles = surface::extract_triangles(errors, kSide, kTolerance).indices.size() / 3;
    ms.push_back(watch.ms());
  }
  return triangles;
}

struct Martini {
  double ms = 0;
  double triangles = 0;
};

Result<Martini> run_martini(const std::vector<float>& terrain, const Setting& setting, int count) {
  const std::filesystem::path folder = std::filesystem::path(TELLURION_SOURCE_DIR) / "bench/martini";
  std::error_code failure;
  if (!std::filesystem::exists(folder / "node_modules/@mapbox/martini", failure))
    return Error{ErrorCode::not_found, "npm package not installed; tools/setup.sh --bench installs it"};
  const auto file = setting.scratch / "terrain.f32";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(terrain.data()), static_cast<std::streamsize>(terrain.size() * sizeof(float)));
  const auto run = run_program({"node", (folder / "time_martini.js").string(), file.string(), std::to_string(kSide),
                                std::to_string(kTolerance), std::to_string(count)});
  if (!run) return run.error();
  const auto answer = nlohmann::json::parse(run->output, nullptr, false);
  if (answer.is_discarded() || !answer.contains("ms") || !answer.contains("triangles"))
    return Error{ErrorCode::corrupt, "time_martini.js did not answer with its figures"};
  return Martini{answer["ms"].get<double>(), answer["triangles"].get<double>()};
}

Result<void> measure_rtin(const Setting& setting, Report& report) {
  const auto terrain = make_terrain();
  const int count = setting.quick ? 20 : 100;
  std::vector<double> ms;
  decimate_often(terrain, 3, ms);  // warm-up
  ms.clear();
  // One half before and one after the other program, so that a change of the machine's speed shows in both.
  decimate_often(terrain, count, ms);
  const auto martini = run_martini(terrain, setting, count);
  const auto triangles = static_cast<double>(decimate_often(terrain, count, ms));
  report.set("time_ms", median(ms), fmt::format("{} triangles, median of {}", triangles, ms.size()));
  if (!martini) return martini.error();
  report.set("martini_ms", martini->ms, fmt::format("@mapbox/martini: {} triangles, median of {}", martini->triangles, count));
  report.set("time_ratio", median(ms) / martini->ms, "ours by theirs");
  report.set("triangles_ratio", triangles / martini->triangles, "ours by theirs");
  return {};
}

}  // namespace

std::vector<Benchmark> rtin_benchmarks() {
  return {{"rtin",
           "257x257 grid of 1,000 m relief decimated at 10 m by martini's criterion, errors and triangles together",
           {{"time_ratio", "ratio", 0.5}, {"triangles_ratio", "ratio", 1.0}, {"time_ms", "ms", {}}, {"martini_ms", "ms", {}}},
           measure_rtin}};
}

}  // namespace tellurion::bench
