// Something that is on its way: who needs it can ask, wait, be told, or say how much it is worth.
// Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <utility>
#include <vector>

namespace tellurion::fetch {

/// What a transfer's end gains, in any unit: of several, the greatest begins first. May change while it waits.
using Gain = std::shared_ptr<std::atomic<double>>;

inline Gain make_gain(double value) { return std::make_shared<std::atomic<double>>(value); }

class Arrival {
 public:
  explicit Arrival(Gain gain = make_gain(0), double expected_bytes = 0) : gain_(std::move(gain)), expected_bytes_(expected_bytes) {}

  void set_gain(double gain) { gain_->store(gain, std::memory_order_relaxed); }
  double gain() const { return gain_->load(std::memory_order_relaxed); }
  /// By what has come from the same place before; 0: nothing has.
  double expected_bytes() const { return expected_bytes_; }

  bool over() const {
    std::lock_guard lock(mutex_);
    return over_;
  }

  /// Waits until it is over or `stop` is requested.
  void wait(const std::stop_token& stop) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [&] { return over_; });
  }

  /// Waits until it is over, or for `patience`; whether it is over.
  bool wait_for(std::chrono::milliseconds patience) const {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [&] { return over_; });
  }

  /// Calls `told` once: when it is over, on any thread, or at once.
  void then(std::function<void()> told) {
    {
      std::lock_guard lock(mutex_);
      if (!over_) {
        to_tell_.push_back(std::move(told));
        return;
      }
    }
    told();
  }

  /// For who brings it.
  void end() {
    std::vector<std::function<void()>> to_tell;
    {
      std::lock_guard lock(mutex_);
      over_ = true;
      to_tell.swap(to_tell_);
    }
    changed_.notify_all();
    for (const auto& told : to_tell) told();
  }

 private:
  const Gain gain_;
  const double expected_bytes_;
  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  bool over_ = false;
  std::vector<std::function<void()>> to_tell_;
};

}  // namespace tellurion::fetch
