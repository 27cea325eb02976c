// Records the camera's way, replays it, and keeps it in a file.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "globe/api.h"

namespace tellurion::apps {

class FlightRecorder {
 public:
  /// `file` is written when a recording ends. If it is there already, it is what is replayed, and what is recorded is
  /// appended to it. Errors: the file is there but no flight.
  static Result<FlightRecorder> open(std::filesystem::path file);

  bool recording() const { return recording_since_.has_value(); }
  bool replaying() const { return replay_.has_value(); }
  bool empty() const { return samples_.empty(); }
  const std::filesystem::path& file() const { return file_; }

  /// `now`: seconds of a clock that runs evenly, the same in all functions.
  void start_recording(double now);
  /// Ends the recording and writes the file. Errors: unavailable.
  Result<void> stop_recording();
  /// Takes down where the camera is, often enough for a smooth replay.
  void note(double now, const view::Pose& pose);

  /// Errors: invalid_argument (nothing to replay).
  Result<void> start_replay(double now);
  void stop_replay() { replay_.reset(); }
  /// Where the replayed camera is; nothing after the end, which ends the replay.
  std::optional<view::Pose> replayed(double now);

 private:
  struct Replay {
    view::Flight flight;
    double started_at;
  };
  explicit FlightRecorder(std::filesystem::path file) : file_(std::move(file)) {}

  std::filesystem::path file_;
  std::vector<view::FlightSample> samples_;
  std::optional<double> recording_since_;  ///< the clock's time at the recording's zero
  std::optional<Replay> replay_;
};

}  // namespace tellurion::apps
