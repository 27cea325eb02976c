// What workers do: tiles out of resident data, and the error table of a raster.
#include <stop_token>

#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"
#include "cache/block_cache.h"
#include "globe/surface_worker.h"

namespace tellurion::bench {
namespace {

/// Tiles of nine levels at Mt Rainier and beside it.
std::vector<geo::TileKey> tiles_at_rainier() {
  const auto normal = geo::normal_at({to_radians(Degrees(46.85)), to_radians(Degrees(-121.76))});
  std::vector<geo::TileKey> keys;
  for (int level = 5; level <= 13; ++level) {
    const geo::TileKey key = geo::tile_at(normal, level);
    keys.push_back(key);
    for (const auto side : {geo::Side::north, geo::Side::east, geo::Side::south, geo::Side::west})
      keys.push_back(geo::neighbour(key, side));
  }
  return keys;
}

/// Times of `build` for every key, after one pass that reads the data.
template <class Build>
Result<std::vector<double>> build_times(const std::vector<geo::TileKey>& keys, int passes, Build&& build) {
  std::vector<double> ms;
  for (int pass = 0; pass <= passes; ++pass) {
    for (const geo::TileKey& key : keys) {
      const CpuStopwatch watch;
      if (const auto built = build(key); !built) return built.error();
      if (pass > 0) ms.push_back(watch.ms());
    }
  }
  return ms;
}

Result<void> measure_tiles(const Setting& setting, Report& report) {
  auto world = default_world_with(setting, {{globe::LayerGroup::height, kRainier}});
  if (!world) return world.error();
  auto globe = open_with_tables(std::move(*world), setting);
  if (!globe) return globe.error();
  cache::BlockCache blocks(std::size_t{256} << 20);
  globe::SurfaceWorker worker(blocks);
  const auto surface = (*globe)->surface();
  const auto facts = (*globe)->facts();

  const auto keys = tiles_at_rainier();
  const int passes = setting.quick ? 1 : 5;
  const auto geometry = build_times(keys, passes, [&](const geo::TileKey& key) { return worker.build_geometry(surface, *facts, key, {}); });
  if (!geometry) return geometry.error();
  const auto colour = build_times(keys, passes, [&](const geo::TileKey& key) { return worker.build_colour(surface, key, {}); });
  if (!colour) return colour.error();
  const std::string count = fmt::format("of {} builds", geometry->size());
  report.set("build_ms", median(*geometry), "mesh, slopes and errors, median " + count);
  report.set("build_ms_p99", quantile(*geometry, 0.99), count);
  report.set("colour_ms", median(*colour), "patches and their control points, median " + count);
  report.set("colour_ms_p99", quantile(*colour, 0.99), count);
  return {};
}

Result<void> measure_scan(const Setting& setting, Report& report) {
  std::vector<double> seconds;
  for (int i = 0; i < (setting.quick ? 1 : 3); ++i) {
    auto world = default_world_with(setting, {});
    if (!world) return world.error();
    const Stopwatch watch;
    auto globe = globe::Globe::open(std::move(*world), {});  // nothing is kept
    if (!globe) return globe.error();
    if (!(*globe)->wait_for_tables(std::chrono::steady_clock::now() + std::chrono::minutes(5)))
      return {ErrorCode::unavailable, "the error table is not ready after five minutes"};
    seconds.push_back(watch.seconds());
  }
  report.set("etopo5_s", median(seconds), fmt::format("median of {}", seconds.size()));
  return {};
}

}  // namespace

std::vector<Benchmark> tile_benchmarks() {
  return {{"tile",
           "tiles of levels 5 to 13 at Mt Rainier on one worker, data resident, default world and 90 m heights, processor time",
           {{"build_ms", "ms", {}}, {"build_ms_p99", "ms", {}}, {"colour_ms", "ms", {}}, {"colour_ms_p99", "ms", {}}},
           measure_tiles},
          {"scan",
           "opening the default world (4320x2161 heights) and making its error table",
           {{"etopo5_s", "s", {}}},
           measure_scan}};
}

}  // namespace tellurion::bench
