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

/// Places spread evenly over a range of latitudes and longitudes, in no order.
std::vector<geo::LatLon> random_places(std::size_t count, double south, double north, double west, double east) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> latitude(south, north), longitude(west, east);
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
    const Stopwatch watch;
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
  {
    auto world = default_world_with(setting, {});
    if (!world) return world.error();
    auto globe = open_with_tables(std::move(*world), setting);
    if (!globe) return globe.error();
    auto sampler = (*globe)->height_sampler();
    if (!sampler) return sampler.error();
    const auto rate = queries_per_second(*sampler, random_places(count, -89.9, 89.9, -180.0, 180.0), globe::HeightLookup::bilinear);
    if (!rate) return rate.error();
    report.set("bilinear_world", *rate, "default world, the whole Earth; " + passes);
  }
  auto world = default_world_with(setting, {{globe::LayerGroup::height, kRainier}});
  if (!world) return world.error();
  auto globe = open_with_tables(std::move(*world), setting);
  if (!globe) return globe.error();
  auto sampler = (*globe)->height_sampler();
  if (!sampler) return sampler.error();
  const auto places = random_places(count, 46.75, 46.95, -121.90, -121.60);
  for (const auto& [measure, lookup] : {std::pair("bilinear", globe::HeightLookup::bilinear), std::pair("nearest", globe::HeightLookup::nearest)}) {
    const auto rate = queries_per_second(*sampler, places, lookup);
    if (!rate) return rate.error();
    report.set(measure, *rate, "round Mt Rainier, 90 m heights over the default world; " + passes);
  }
  return {};
}

}  // namespace

std::vector<Benchmark> query_benchmarks() {
  constexpr double kGoal = 2e6;
  return {{"queries",
           "heights one by one on one core, data resident",
           {{"bilinear", "1/s", kGoal, Better::higher},
            {"bilinear_world", "1/s", kGoal, Better::higher},
            {"nearest", "1/s", {}, Better::higher}},
           measure_queries}};
}

}  // namespace tellurion::bench
