#include "globe/frame_stats.h"

#include <algorithm>
#include <fstream>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace tellurion::globe {
namespace {

/// Calls `visit(name, value)` for every figure, in the order of a trace.
template <class Visit>
void for_each_figure(const FrameStats& s, Visit&& visit) {
  visit("frame", s.frame);
  visit("time", s.time);
  visit("frame_ms", s.frame_ms);
  visit("select_ms", s.select_ms);
  visit("upload_ms", s.upload_ms);
  visit("draw_ms", s.draw_ms);
  visit("tiles_visited", s.tiles_visited);
  visit("tiles_selected", s.tiles_selected);
  visit("tiles_selected_by_level", s.tiles_selected_by_level);
  visit("tiles_drawn", s.tiles_drawn);
  visit("tiles_drawn_by_level", s.tiles_drawn_by_level);
  visit("tiles_waiting", s.tiles_waiting);
  visit("triangles", s.triangles);
  visit("draws", s.draws);
  visit("requests", s.requests);
  visit("requests_cancelled", s.requests_cancelled);
  visit("bytes_fetched", s.bytes_fetched);
  visit("bytes_uploaded", s.bytes_uploaded);
  visit("memory_cache_bytes", s.memory_cache_bytes);
  visit("gpu_cache_bytes", s.gpu_cache_bytes);
  visit("disk_cache_bytes", s.disk_cache_bytes);
  visit("resident_bytes", s.resident_bytes);
  visit("max_error_px", s.max_error_px);
  visit("frames_over_budget", s.frames_over_budget);
  visit("complete", s.complete);
}

struct CsvCell {
  std::string& line;
  void operator()(const char*, const std::vector<int>& v) { line += fmt::format("{},", fmt::join(v, ";")); }
  void operator()(const char*, bool v) { line += v ? "1," : "0,"; }
  void operator()(const char*, double v) { line += fmt::format("{:.6g},", v); }
  template <class T>
  void operator()(const char*, T v) { line += fmt::format("{},", v); }
};

/// The value below which `share` of the sorted values lie.
double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(share * last + 0.5)];
}

}  // namespace

std::string trace_header() {
  std::string line;
  for_each_figure(FrameStats{}, [&](const char* name, const auto&) { line += fmt::format("{},", name); });
  line.back() = '\n';
  return line;
}

std::string trace_line(const FrameStats& stats) {
  std::string line;
  for_each_figure(stats, CsvCell{line});
  line.back() = '\n';
  return line;
}

std::string to_json(const SummaryStats& stats) {
  nlohmann::ordered_json json;
  for_each_figure(stats.last, [&](const char* name, const auto& value) { json[name] = value; });
  std::vector<double> sorted = stats.frame_ms;
  std::sort(sorted.begin(), sorted.end());
  json["load_ms"] = stats.load_ms;
  json["frame_ms_median"] = quantile(sorted, 0.5);
  json["frame_ms_p99"] = quantile(sorted, 0.99);
  json["frame_ms_max"] = sorted.empty() ? 0.0 : sorted.back();
  json["sources"] = nlohmann::ordered_json::array();
  for (const SourceStats& s : stats.sources) {
    json["sources"].push_back({{"name", s.name},
                               {"requests", s.requests},
                               {"bytes", s.bytes},
                               {"errors", s.errors},
                               {"last_error", s.last_error}});
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::int64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t total_pages = 0;
  std::int64_t resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0;
  return resident_pages * sysconf(_SC_PAGESIZE);
}

}  // namespace tellurion::globe
