// Frames whose times last until the driver is done with them: what a frame really costs.
#pragma once

#include <chrono>

#include "globe/api.h"

namespace tellurion::apps {

class TimedFrames {
 public:
  explicit TimedFrames(globe::GlobeView& view) : view_(view) {}

  /// Draws a frame. Its `frame_ms`, `draw_ms` and `frames_over_budget` count the driver's work too.
  globe::FrameStats draw(const view::Camera& camera, const globe::ViewSettings& settings) {
    const auto start = std::chrono::steady_clock::now();
    globe::FrameStats stats = view_.draw(camera, settings);
    view_.thread().finish();
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    stats.draw_ms += ms - stats.frame_ms;
    stats.frame_ms = ms;
    if (ms > kBudgetMs) ++over_budget_;
    stats.frames_over_budget = over_budget_;
    return stats;
  }

 private:
  static constexpr double kBudgetMs = 1000.0 / 30.0;

  globe::GlobeView& view_;
  std::int64_t over_budget_ = 0;
};

}  // namespace tellurion::apps
