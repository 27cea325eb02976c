// The figures of a frame, under the names that programs rely on.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace tellurion::globe {

/// Times in milliseconds, sizes in bytes. One line of a trace.
struct FrameStats {
  std::int64_t frame = 0;
  double time = 0;  ///< seconds since the view was made, or of the flight
  double frame_ms = 0;
  double select_ms = 0;
  double upload_ms = 0;
  double draw_ms = 0;
  int tiles_visited = 0;
  int tiles_selected = 0;
  std::vector<int> tiles_selected_by_level;
  int tiles_drawn = 0;
  std::vector<int> tiles_drawn_by_level;
  int tiles_waiting = 0;
  std::int64_t triangles = 0;
  int draws = 0;
  std::int64_t requests = 0;            ///< tile parts asked for since the start
  std::int64_t requests_cancelled = 0;
  std::int64_t bytes_fetched = 0;       ///< over the network
  std::int64_t bytes_uploaded = 0;
  std::int64_t memory_cache_bytes = 0;
  std::int64_t gpu_cache_bytes = 0;
  std::int64_t disk_cache_bytes = 0;
  std::int64_t resident_bytes = 0;
  double max_error_px = 0;
  std::int64_t frames_over_budget = 0;  ///< frames that took longer than 1/30 s since the start
  bool complete = false;
};

/// What a source did so far.
struct SourceStats {
  std::string name;
  std::int64_t requests = 0;  ///< blocks of samples asked of it
  std::int64_t bytes = 0;     ///< decoded
  std::int64_t errors = 0;
  std::string last_error;
};

/// The figures of a finished picture or a flight: the last frame, the load time and the frame times' distribution.
struct SummaryStats {
  FrameStats last;
  double load_ms = 0;
  std::vector<double> frame_ms;         ///< every frame's
  std::vector<SourceStats> sources;
};

/// The header line of a trace, and a line of it (with newline).
std::string trace_header();
std::string trace_line(const FrameStats& stats);

/// The figures as a JSON object.
std::string to_json(const SummaryStats& stats);

/// Memory of this process that is resident, in bytes.
std::int64_t resident_bytes();

}  // namespace tellurion::globe
