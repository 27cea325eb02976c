// Point queries of heights on one core, all data resident.
#include <cmath>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

/// Degrees.
struct Region {
  double south, north, west, east;
};
constexpr Region kRoundRainier{46.75, 46.95, -121.90, -121.60}, kWholeEarth{-89.9, 89.9, -180.0, 180.0};

/// Places spread evenly over latitudes and longitudes, in no order.
std::vector<geo::LatLon> random_places(std::size_t count, const Region& region) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> latitude(region.south, region.north), longitude(region.west, region.east);
  std::vector<geo::LatLon> places;
  for (std::size_t i = 0; i < count; ++i) {
    const Degrees lat(latitude(random)), lon(longitude(random));
    places.push_back({to_radians(lat), to_radians(lon)});
  }
  return places;
}

Result<double> queries_per_second(globe::HeightSampler& sampler, const std::vector<geo::LatLon>& places,
                                  globe::HeightLookup lookup) {
  std::vector<double> rates;
  double sum = 0.0;
  for (int pass = 0; pass < 6; ++pass) {
    const CpuStopwatch watch;
    for (const geo::LatLon& place : places) {
      const auto answer = sampler.height_at(place, lookup);
      if (!answer) return answer.error();
      sum += answer->height.value;
    }
    if (pass > 0) rates.push_back(static_cast<double>(places.size()) / watch.seconds());  // the first one loads
  }
  if (!std::isfinite(sum)) return Error{ErrorCode::internal, "a height is no number"};
  return median(rates);
}

Result<void> measure_queries(const Setting& setting, Report& report) {
  const std::size_t count = setting.quick ? 100'000 : 1'000'000;
  const std::string passes = fmt::format("{} places at random, median of 5 passes", count);
  const auto measure = [&](Result<globe::World> world, const Region& region, globe::HeightLookup lookup, const char* name,
                           const char* note) -> Result<void> {
    if (!world) return world.error();
    globe::GlobeOptions options;
    options.scan_heights = false;
    auto globe = globe::Globe::open(std::move(*world), options);
    if (!globe) return globe.error();
    auto sampler = (*globe)->height_sampler();
    if (!sampler) return sampler.error();
    const auto rate = queries_per_second(*sampler, random_places(count, region), lookup);
    if (!rate) return rate.error();
    report.set(name, *rate, fmt::format("{}; {}", note, passes));
    return {};
  };
  const DataLayer rainier{globe::LayerGroup::height, kRainier};
  using enum globe::HeightLookup;
  if (auto done = measure(default_world_with(setting, {}), kWholeEarth, bilinear, "bilinear_world", "default world, the whole Earth"); !done)
    return done;
  if (auto done = measure(world_of(setting, {rainier}), kRoundRainier, bilinear, "bilinear", "one raster of 90 m"); !done) return done;
  if (auto done = measure(world_of(setting, {rainier}), kRoundRainier, nearest, "nearest", "one raster of 90 m"); !done) return done;
  return measure(default_world_with(setting, {rainier}), kRoundRainier, bilinear, "bilinear_layers", "90 m over the default world");
}

}  // namespace

std::vector<Benchmark> query_benchmarks() {
  constexpr double kGoal = 2e6;
  return {{"queries",
           "heights one by one on one core, data resident, processor time",
           {{"bilinear", "1/s", kGoal, Better::higher},
            {"bilinear_layers", "1/s", kGoal, Better::higher},
            {"bilinear_world", "1/s", kGoal, Better::higher},
            {"nearest", "1/s", {}, Better::higher}},
           measure_queries}};
}

}  // namespace tellurion::bench
