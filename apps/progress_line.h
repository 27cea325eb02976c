// A line of progress on standard error.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

namespace tellurion::apps {

inline std::string duration_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  return whole < 3600 ? fmt::format("{}:{:02}", whole / 60, whole % 60) : fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

/// A bar on a terminal, elsewhere a line every few seconds.
class ProgressLine {
 public:
  using Clock = std::chrono::steady_clock;

  ProgressLine(double count, const char* unit, Clock::time_point start = Clock::now()) : count_(count), unit_(unit), start_(start) {}

  void show(double done, double bytes, bool last = false) {
    const bool terminal = isatty(STDERR_FILENO) != 0;
    if (!last && !terminal && seconds_since(shown_) < 5.0) return;
    shown_ = Clock::now();
    constexpr double kMegabyte = 1 << 20;
    const double seconds = std::max(seconds_since(start_), 1e-3), rate = done / seconds;
    std::string text = fmt::format("{:.0f} of {:.0f} {}, {:.0f}/s, {:.1f} MB at {:.1f} MB/s", done, count_, unit_, rate, bytes / kMegabyte, bytes / kMegabyte / seconds);
    if (!last && rate > 0.0) text += fmt::format(", {} left", duration_text((count_ - done) / rate));
    const auto filled = static_cast<std::size_t>(std::clamp(30.0 * done / std::max(count_, 1e-9), 0.0, 30.0));
    if (terminal) fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:<70}{}", "", filled, "", 30 - filled, text, last ? "\n" : "");
    else fmt::print(stderr, "{}\n", text);
  }

 private:
  static double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

  double count_;
  const char* unit_;
  Clock::time_point start_;
  Clock::time_point shown_ = Clock::now();
};

}  // namespace tellurion::apps
