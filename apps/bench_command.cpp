// tellurion bench: the benchmarks, against their goals.
#include "commands.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/output.h"
#include "bench/registry.h"
#include "options.h"

namespace tellurion::apps {
namespace {

struct BenchOptions {
  std::vector<std::string> names;
  std::filesystem::path json_file;
  std::filesystem::path data;
  bool list = false;
  bool quick = false;
};

/// A new folder that goes with this.
class ScratchFolder {
 public:
  static Result<ScratchFolder> create() {
    std::error_code failure;
    std::string name = (std::filesystem::temp_directory_path(failure) / "tellurion-bench-XXXXXX").string();
    if (failure || !mkdtemp(name.data())) return Error{ErrorCode::unavailable, fmt::format("{}: {}", name, std::strerror(errno))};
    return ScratchFolder(name);
  }
  ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ~ScratchFolder() {
    std::error_code failure;
    if (!path_.empty()) std::filesystem::remove_all(path_, failure);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

void print_list(std::FILE* stream, std::span<const bench::Benchmark> benchmarks, std::span<const std::string> names) {
  for (const auto& benchmark : benchmarks) {
    for (const auto& measure : benchmark.measures) {
      const std::string name = bench::full_name(benchmark, measure);
      if (bench::is_named(names, name))
        fmt::print(stream, "{:<36} {:<11} {:<17} {}\n", name, measure.unit, bench::goal_text(measure), benchmark.conditions);
    }
  }
}

int run_benchmarks(const BenchOptions& options) {
  const auto benchmarks = bench::all_benchmarks();
  if (const auto unknown = bench::first_unknown(benchmarks, options.names)) {
    fmt::print(stderr, "tellurion: there is no benchmark \"{}\"; these are the names, of which a first part names a group:\n", *unknown);
    print_list(stderr, benchmarks, {});
    return kWrongUsage;
  }
  if (options.list) {
    print_list(stdout, benchmarks, options.names);
    return kDone;
  }

  const auto scratch = ScratchFolder::create();
  if (!scratch) return report(scratch.error());
  const bench::Setting setting{options.data, scratch->path(), options.quick};
  fmt::print("{}\n", bench::machine_line());
  int status = kDone;
  std::vector<bench::Figure> figures;
  for (const auto& benchmark : benchmarks) {
    const auto is_wanted = [&](const std::string& measure) { return bench::is_named(options.names, measure); };
    if (std::ranges::none_of(benchmark.measures, [&](const auto& m) { return is_wanted(bench::full_name(benchmark, m)); })) continue;
    fmt::print("\n{}: {}\n", benchmark.name, benchmark.conditions);
    std::fflush(stdout);
    auto outcome = bench::run(benchmark, setting);
    std::erase_if(outcome.figures, [&](const auto& figure) { return !is_wanted(figure.measure.name); });
    for (const auto& figure : outcome.figures) fmt::print("  {}\n", bench::table_line(figure));
    std::ranges::move(outcome.figures, std::back_inserter(figures));
    // What is not installed cannot be measured with; that is no failure.
    if (!outcome.result && outcome.result.error().code != ErrorCode::not_found) status = report(outcome.result.error());
  }
  if (!options.json_file.empty()) {
    if (const auto written = write_text(options.json_file, bench::to_json(figures)); !written) return report(written.error());
  }
  return status;
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
  auto options = std::make_shared<BenchOptions>();
  options->data = bench::default_data();
  CLI::App* command = app.add_subcommand("bench", "the benchmarks, against their goals");
  command->add_option("NAME", options->names, "benchmarks or groups of them; default: all")->type_name("")->take_all();
  command->add_flag("--list", options->list, "only name them");
  command->add_option("--json", options->json_file, "also write the figures: an array of {name, value, unit, goal, note}")->type_name("FILE");
  command->add_option("--data", options->data, "the folder of the larger data sets, without which some are left out")
      ->envname("TELLURION_SHARED_DATA_DIR")->type_name("DIR");
  command->add_flag("--quick", options->quick, "fewer repetitions");
  command->callback([options, &run] { run = [options] { return run_benchmarks(*options); }; });
}

}  // namespace tellurion::apps
