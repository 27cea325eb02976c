#include "base/bounded_queue.h"

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

using namespace tellurion;
using std::chrono::steady_clock;

TEST_CASE("BoundedQueue: gives items in the order in which they came") {
  BoundedQueue<int> queue(3);
  CHECK(queue.push(1));
  CHECK(queue.push(2));
  CHECK(queue.try_pop() == 1);
  CHECK(queue.try_pop() == 2);
  CHECK_FALSE(queue.try_pop());
}

TEST_CASE("BoundedQueue: push waits for room and never exceeds the bound") {
  BoundedQueue<int> queue(2);
  std::atomic<int> pushed = 0;
  std::jthread producer([&] {
    for (int i = 0; i < 1000; ++i) {
      if (!queue.push(i)) return;
      ++pushed;
    }
  });
  for (int expected = 0; expected < 1000; ++expected) {
    CHECK(queue.size() <= 2);
    REQUIRE(queue.pop_until(steady_clock::now() + std::chrono::seconds(10)) == expected);
  }
  producer.join();
  CHECK(pushed == 1000);
}

TEST_CASE("BoundedQueue: close wakes who waits for room, and drops the item") {
  BoundedQueue<int> queue(1);
  CHECK(queue.push(1));
  std::atomic<bool> accepted = true;
  std::jthread producer([&] { accepted = queue.push(2); });
  queue.close();
  producer.join();
  CHECK_FALSE(accepted);
  CHECK(queue.try_pop() == 1);
  CHECK_FALSE(queue.try_pop());
}

TEST_CASE("BoundedQueue: close wakes who waits for an item") {
  BoundedQueue<int> queue(1);
  std::jthread closer([&] { queue.close(); });
  CHECK_FALSE(queue.pop_until(steady_clock::now() + std::chrono::seconds(10)));
}

TEST_CASE("BoundedQueue: pop_until gives up at its deadline") {
  BoundedQueue<int> queue(1);
  CHECK_FALSE(queue.pop_until(steady_clock::now() + std::chrono::milliseconds(1)));
}

TEST_CASE("BoundedQueue: carries items that can only be moved") {
  BoundedQueue<std::unique_ptr<int>> queue(1);
  CHECK(queue.push(std::make_unique<int>(5)));
  CHECK(**queue.try_pop() == 5);
}
