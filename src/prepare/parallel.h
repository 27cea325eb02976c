// The same work for many items on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/result.h"

namespace tellurion::prepare {

/// Calls `work(worker, item)` for items 0 to count - 1 on up to `workers` threads, in about that order; stops at the first error,
/// which it gives back. `worker` is in [0, workers).
template <class Work>
Result<void> for_each_item(int count, int workers, const Work& work) {
  std::atomic<int> next{0};
  std::mutex mutex;
  std::optional<Error> failure;
  const auto run = [&](int worker) noexcept {
    for (int item = next++; item < count; item = next++) {
      Result<void> done = work(worker, item);
      if (done) continue;
      const std::lock_guard lock(mutex);
      if (!failure) failure = done.error();
      next = count;
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int worker = 1; worker < std::min(workers, count); ++worker) threads.emplace_back(run, worker);
    run(0);
  }
  if (failure) return *failure;
  return {};
}

}  // namespace tellurion::prepare
