// Benchmarks by name: what they measure, against which goals, and how they are run.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace tellurion::bench {

enum class Better { lower, higher };

/// What a figure is. Its name is relative to its benchmark's.
struct Measure {
  std::string name;
  std::string unit;
  std::optional<double> goal;  ///< to be met or beaten
  Better better = Better::lower;
};

/// A measure with its full name, and what came out.
struct Figure {
  Measure measure;
  std::optional<double> value;  ///< nothing: it could not be measured, the note says why
  std::string conditions;       ///< its benchmark's
  std::string note;             ///< what else is to be known of the value

  /// Whether the goal is met; nothing without a goal or a value.
  std::optional<bool> meets_goal() const;
};

/// What all benchmarks of a run share.
struct Setting {
  std::filesystem::path data;     ///< folder of the larger data sets, which are no part of the project
  std::filesystem::path scratch;  ///< a folder for all that is written; it goes after the run
  bool quick = false;             ///< fewer repetitions
};

struct Benchmark;

/// Takes the figures of one benchmark.
class Report {
 public:
  explicit Report(const Benchmark& benchmark);

  /// The value of a measure of the benchmark (asserted).
  void set(std::string_view measure, double value, const std::string& note = {});

  /// All figures; those that were not set are not measured because of `reason`.
  std::vector<Figure> finish(const std::string& reason) &&;

 private:
  std::vector<Figure> figures_;
  std::size_t prefix_length_;
};

/// Measures that come out of one run.
struct Benchmark {
  std::string name;        ///< words separated by dots
  std::string conditions;  ///< in one sentence
  std::vector<Measure> measures;
  std::function<Result<void>(const Setting&, Report&)> run;
};

/// Where the larger data sets lie unless told otherwise: beside the source tree.
std::filesystem::path default_data();

/// Every benchmark, in the order in which they are run.
std::vector<Benchmark> all_benchmarks();

std::string full_name(const Benchmark& benchmark, const Measure& measure);

/// Whether one of `names` is `measure` or a group that it belongs to ("frame" for "frame.rainier.tiles"). No names: all.
bool is_named(std::span<const std::string> names, std::string_view measure);

/// The first of `names` that is neither a measure nor a group.
std::optional<std::string> first_unknown(std::span<const Benchmark> benchmarks, std::span<const std::string> names);

struct Outcome {
  std::vector<Figure> figures;  ///< all of the benchmark
  Result<void> result;          ///< not_found: something to measure with is not installed
};
Outcome run(const Benchmark& benchmark, const Setting& setting);

}  // namespace tellurion::bench
