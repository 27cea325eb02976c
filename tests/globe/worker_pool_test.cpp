#include "globe/worker_pool.h"

#include <atomic>
#include <chrono>
#include <future>
#include <string>

#include <doctest/doctest.h>

using tellurion::globe::WorkerPool;

TEST_CASE("WorkerPool: runs every job, in its own context") {
  std::atomic<int> sum{0};
  std::atomic<bool> in_range{true};
  std::promise<void> all;
  {
    WorkerPool pool(3, 200);
    CHECK(pool.worker_count() == 3);
    for (int i = 1; i <= 100; ++i) {
      REQUIRE(pool.try_submit([&, i](int worker) {
        if (worker < 0 || worker >= 3) in_range = false;
        if ((sum += i) == 5050) all.set_value();
      }));
    }
    CHECK(all.get_future().wait_for(std::chrono::seconds(20)) == std::future_status::ready);
  }
  CHECK(sum == 5050);
  CHECK(in_range);
}

TEST_CASE("WorkerPool: refuses what exceeds its bound instead of waiting") {
  WorkerPool pool(0, 2);
  CHECK(pool.try_submit([](int) {}));
  CHECK(pool.try_submit([](int) {}));
  CHECK_FALSE(pool.try_submit([](int) {}));
  CHECK(pool.waiting() == 2);
}

TEST_CASE("WorkerPool: without threads jobs run when asked to, the background's last") {
  WorkerPool pool(0, 8);
  std::string order;
  pool.submit_background([&](int) { order += 'b'; });
  CHECK(pool.try_submit([&](int worker) { order += static_cast<char>('0' + worker); }));
  CHECK(pool.run_one());
  CHECK(pool.run_one());
  CHECK_FALSE(pool.run_one());
  CHECK(order == "0b");
}
