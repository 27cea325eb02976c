// Something that is on its way: who needs it can ask, wait, or be told.
// Thread-safe.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <utility>
#include <vector>

namespace tellurion::fetch {

class Arrival {
 public:
  bool over() const {
    std::lock_guard lock(mutex_);
    return over_;
  }

  /// Waits until it is over or `stop` is requested.
  void wait(const std::stop_token& stop) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [&] { return over_; });
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
  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  bool over_ = false;
  std::vector<std::function<void()>> to_tell_;
};

}  // namespace tellurion::fetch
