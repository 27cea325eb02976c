// How long to wait for a view whose data fail to come.
// Pure functions of the times that it is given.
#pragma once

#include <chrono>
#include <cstdint>

namespace tellurion::globe {

class Patience {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Something arrived.
  void progressed(TimePoint now) {
    last_progress_ = now;
    failed_ = false;
  }
  /// All bytes that have come so far: more than before is progress.
  void received(std::int64_t bytes, TimePoint now) {
    if (bytes == bytes_) return;
    bytes_ = bytes;
    progressed(now);
  }
  /// Something failed that may yet come.
  void failed() { failed_ = true; }

  /// Whether there have been failures only for as long as six attempts of a file take.
  bool is_over(TimePoint now) const { return failed_ && now - last_progress_ > kLongest; }

 private:
  static constexpr std::chrono::seconds kLongest{16};

  TimePoint last_progress_;
  std::int64_t bytes_ = 0;
  bool failed_ = false;  ///< since the last progress
};

}  // namespace tellurion::globe
