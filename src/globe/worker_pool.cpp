#include "globe/worker_pool.h"

#include <utility>

namespace tellurion::globe {

WorkerPool::WorkerPool(int thread_count, std::size_t capacity) : capacity_(capacity) {
  for (int i = 0; i < thread_count; ++i) threads_.emplace_back([this, i] { work(i); });
}

WorkerPool::~WorkerPool() {
  {
    std::lock_guard lock(mutex_);
    closing_ = true;
    jobs_.clear();
    background_.clear();
  }
  arrival_.notify_all();
}

std::size_t WorkerPool::waiting() const {
  std::lock_guard lock(mutex_);
  return jobs_.size();
}

bool WorkerPool::try_submit(Job job) {
  {
    std::lock_guard lock(mutex_);
    if (closing_ || jobs_.size() >= capacity_) return false;
    jobs_.push_back(std::move(job));
  }
  arrival_.notify_one();
  return true;
}

void WorkerPool::submit_background(Job job) {
  {
    std::lock_guard lock(mutex_);
    if (closing_) return;
    background_.push_back(std::move(job));
  }
  arrival_.notify_one();
}

WorkerPool::Job WorkerPool::take_job() {
  std::deque<Job>& queue = jobs_.empty() ? background_ : jobs_;
  Job job = std::move(queue.front());
  queue.pop_front();
  return job;
}

bool WorkerPool::run_one() {
  Job job;
  {
    std::lock_guard lock(mutex_);
    if (!has_job() || !threads_.empty()) return false;
    job = take_job();
  }
  job(0);
  return true;
}

void WorkerPool::work(int worker) noexcept {
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      arrival_.wait(lock, [&] { return closing_ || has_job(); });
      if (closing_) return;
      job = take_job();
    }
    job(worker);
  }
}

}  // namespace tellurion::globe
