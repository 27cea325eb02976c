// Threads for work that must not be done on the render thread.
// Thread-safe. Without threads (count 0) the jobs wait until someone calls run_one.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace tellurion::globe {

/// Runs jobs in order of submission, a bounded number of them waiting.
class WorkerPool {
 public:
  /// A job gets the number of the worker that runs it, in [0, max(1, count)). It must not throw.
  using Job = std::function<void(int worker)>;

  WorkerPool(int thread_count, std::size_t capacity);
  /// Drops the jobs that wait and joins.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int thread_count() const { return static_cast<int>(threads_.size()); }
  /// Contexts that jobs can be run in: at least 1.
  int worker_count() const { return threads_.empty() ? 1 : thread_count(); }
  /// Jobs that wait.
  std::size_t waiting() const;

  /// False if `capacity` jobs wait already. Never waits.
  bool try_submit(Job job);
  /// A job for when no other waits. The caller bounds how many there are.
  void submit_background(Job job);

  /// Without threads: runs the first waiting job here. False if there is none, or there are threads.
  bool run_one();

 private:
  void work(int worker) noexcept;
  bool has_job() const { return !jobs_.empty() || !background_.empty(); }
  Job take_job();

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable arrival_;
  std::deque<Job> jobs_;
  std::deque<Job> background_;
  bool closing_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace tellurion::globe
