// From nothing to the first finished picture: the program itself, run as a user would.
#include <fmt/format.h>

#include "bench/child_process.h"
#include "bench/groups.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

Result<double> seconds_to_picture(const Setting& setting, const std::filesystem::path& cache) {
  const auto run = run_program({this_program().string(), "render", "--out", (setting.scratch / "start.png").string(), "--disk-cache", cache.string()});
  if (!run) return run.error();
  return run->seconds;
}

Result<void> measure_start(const Setting& setting, Report& report) {
  std::vector<double> cold, warm;
  const int count = setting.quick ? 1 : 5;
  for (int i = 0; i < count; ++i) {
    const auto cache = setting.scratch / fmt::format("start-{}", i);
    for (std::vector<double>* seconds : {&cold, &warm}) {
      const auto taken = seconds_to_picture(setting, cache);
      if (!taken) return taken.error();
      seconds->push_back(*taken);
    }
  }
  const std::string runs = fmt::format("median of {} runs", count);
  report.set("cold_s", median(cold), "error tables made on the way; " + runs);
  report.set("warm_s", median(warm), "error tables kept from the run before; " + runs);
  return {};
}

}  // namespace

std::vector<Benchmark> start_benchmarks() {
  return {{"start",
           "tellurion render of the default world, from the start of the program to its end, picture written",
           {{"cold_s", "s", {}}, {"warm_s", "s", {}}},
           measure_start}};
}

}  // namespace tellurion::bench
