#include "bench/registry.h"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "bench/groups.h"

namespace tellurion::bench {
namespace {

bool is_group_of(std::string_view group, std::string_view name) {
  return name.starts_with(group) && (name.size() == group.size() || name[group.size()] == '.');
}

}  // namespace

std::optional<bool> Figure::meets_goal() const {
  if (!value || !measure.goal) return std::nullopt;
  return measure.better == Better::lower ? *value <= *measure.goal : *value >= *measure.goal;
}

Report::Report(const Benchmark& benchmark) : prefix_length_(benchmark.name.size() + 1) {
  for (const Measure& measure : benchmark.measures) {
    Figure figure{measure, std::nullopt, benchmark.conditions, {}};
    figure.measure.name = full_name(benchmark, measure);
    figures_.push_back(std::move(figure));
  }
}

void Report::set(std::string_view measure, double value, const std::string& note) {
  const auto found = std::ranges::find_if(
      figures_, [&](const Figure& f) { return std::string_view(f.measure.name).substr(prefix_length_) == measure; });
  assert(found != figures_.end());
  found->value = value;
  found->note = note;
}

std::vector<Figure> Report::finish(const std::string& reason) && {
  for (Figure& figure : figures_) {
    if (!figure.value) figure.note = "not measured: " + reason;
  }
  return std::move(figures_);
}

std::filesystem::path default_data() {
  return (std::filesystem::path(TELLURION_SOURCE_DIR) / "../shared/data").lexically_normal();
}

std::vector<Benchmark> all_benchmarks() {
  std::vector<Benchmark> all;
  for (const auto group : {frame_benchmarks, rtin_benchmarks, query_benchmarks, tile_benchmarks, start_benchmarks,
                           truth_benchmarks, pole_benchmarks, hole_benchmarks, memory_benchmarks, catalogue_benchmarks,
                           layer_benchmarks, ingest_benchmarks}) {
    std::ranges::move(group(), std::back_inserter(all));
  }
  return all;
}

std::string full_name(const Benchmark& benchmark, const Measure& measure) { return benchmark.name + "." + measure.name; }

bool is_named(std::span<const std::string> names, std::string_view measure) {
  return names.empty() || std::ranges::any_of(names, [&](const std::string& name) { return is_group_of(name, measure); });
}

std::optional<std::string> first_unknown(std::span<const Benchmark> benchmarks, std::span<const std::string> names) {
  for (const std::string& name : names) {
    const bool known = std::ranges::any_of(benchmarks, [&](const Benchmark& benchmark) {
      return std::ranges::any_of(benchmark.measures,
                                 [&](const Measure& m) { return is_group_of(name, full_name(benchmark, m)); });
    });
    if (!known) return name;
  }
  return std::nullopt;
}

Outcome run(const Benchmark& benchmark, const Setting& setting) {
  Report report(benchmark);
  auto result = benchmark.run(setting, report);
  auto figures = std::move(report).finish(result ? "this build cannot tell" : result.error().message);
  return {std::move(figures), std::move(result)};
}

}  // namespace tellurion::bench
