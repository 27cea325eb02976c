#include "cache/block_cache.h"

#include <atomic>
#include <barrier>
#include <chrono>
#include <random>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::cache;

namespace {

constexpr std::size_t kBlockBytes = 64 * 64 * sizeof(float);
constexpr std::size_t kOverhead = 256;  // bookkeeping that may be counted with a block

Result<raster::HeightGrid> block_of(float value) { return raster::HeightGrid{64, 64, std::vector<float>(64 * 64, value)}; }

BlockKey column(std::int32_t i) { return {1, 0, i, 0}; }

}  // namespace

TEST_CASE("BlockCache: a block is decoded once and found again") {
  BlockCache cache(10 * kBlockBytes);
  int decoded = 0;
  const auto decode = [&] { return ++decoded, block_of(5); };
  const Frozen<raster::HeightGrid> first = *cache.heights(column(0), decode);
  const Frozen<raster::HeightGrid> second = *cache.heights(column(0), decode);
  CHECK(decoded == 1);
  CHECK(first.get() == second.get());
  CHECK(first->at(3, 3) == 5.0f);
}

TEST_CASE("BlockCache: heights and colours of the same key are different blocks") {
  BlockCache cache(10 * kBlockBytes);
  CHECK(cache.heights(column(0), [] { return block_of(5); }));
  const auto image = cache.image(column(0), []() -> Result<raster::Image> { return raster::Image{1, 1, {1, 2, 3, 4}}; });
  REQUIRE(image);
  CHECK(image.value()->at(0, 0)[2] == 3);
}

TEST_CASE("BlockCache: the least recently used block goes first") {
  BlockCache cache(3 * (kBlockBytes + kOverhead));
  int decoded = 0;
  const auto ask = [&](std::int32_t i) { CHECK(cache.heights(column(i), [&] { return ++decoded, block_of(1); })); };
  ask(0), ask(1), ask(2);
  ask(0);  // now 1 is the oldest
  ask(3);
  CHECK(decoded == 4);
  ask(0), ask(2), ask(3);
  CHECK(decoded == 4);
  ask(1);
  CHECK(decoded == 5);
}

TEST_CASE("BlockCache: bytes stay within the budget plus one block, and a block larger than the budget is served") {
  BlockCache cache(2 * kBlockBytes);
  for (std::int32_t i = 0; i < 50; ++i) {
    CHECK(cache.heights(column(i), [] { return block_of(1); }));
    CHECK(cache.bytes() <= cache.budget_bytes() + kBlockBytes + kOverhead);
    CHECK(cache.bytes() > 0);
  }
  BlockCache none(0);
  CHECK(none.heights(column(0), [] { return block_of(2); }).value()->at(0, 0) == 2.0f);
  CHECK(none.bytes() <= kBlockBytes + kOverhead);
}

TEST_CASE("BlockCache: blocks that are cheap to remake keep to their share and push no others out") {
  constexpr std::size_t kBytes = kBlockBytes + kOverhead;
  BlockCache cache(10 * kBytes, 3 * kBytes);
  int dear = 0, cheap = 0;
  const auto ask_dear = [&](std::int32_t i) { CHECK(cache.heights(column(i), [&] { return ++dear, block_of(1); })); };
  const auto ask_cheap = [&](std::int32_t i) {
    CHECK(cache.image(column(i), [&]() -> Result<raster::Image> { return ++cheap, raster::Image{64, 64, std::vector<std::uint8_t>(64 * 64 * 4)}; }, Remaking::cheap));
  };
  for (int i = 0; i < 6; ++i) ask_dear(i);
  for (int i = 0; i < 50; ++i) ask_cheap(i);
  CHECK(cache.bytes() <= 9 * kBytes);
  for (int i = 0; i < 6; ++i) ask_dear(i);
  CHECK(dear == 6);
  for (int i = 47; i < 50; ++i) ask_cheap(i);
  CHECK(cheap == 50);
  ask_cheap(46);
  CHECK(cheap == 51);
  // The oldest of all goes where all of it is full.
  for (int i = 6; i < 30; ++i) ask_dear(i);
  CHECK(cache.bytes() <= 11 * kBytes);
  ask_cheap(46);
  CHECK(cheap == 52);
}

TEST_CASE("BlockCache: a block that was pushed out stays valid for those who hold it") {
  BlockCache cache(0);
  const Frozen<raster::HeightGrid> held = *cache.heights(column(0), [] { return block_of(3); });
  CHECK(cache.heights(column(1), [] { return block_of(4); }));
  CHECK(held->at(63, 63) == 3.0f);
}

TEST_CASE("BlockCache: an error is passed on and not kept") {
  BlockCache cache(10 * kBlockBytes);
  const auto failed = cache.heights(column(0), []() -> Result<raster::HeightGrid> { return {ErrorCode::corrupt, "bad block"}; });
  REQUIRE(!failed);
  CHECK(failed.error().message == "bad block");
  CHECK(cache.bytes() == 0);
  CHECK(cache.reads_of(column(0).source).errors == 1);
  CHECK(cache.reads_of(column(0).source).last_error == "bad block");
  CHECK(cache.reads_of(column(0).source).blocks == 0);
  CHECK(cache.heights(column(0), [] { return block_of(1); }));
  CHECK(cache.heights(column(0), [] { return block_of(1); }));
  CHECK(cache.reads_of(column(0).source).blocks == 1);
  CHECK(cache.reads_of(column(0).source).bytes > 0);
  CHECK(cache.reads_of(column(0).source + 1).blocks == 0);
}

TEST_CASE("BlockCache: threads that want the same block wait for one decoding") {
  BlockCache cache(10 * kBlockBytes);
  constexpr int kThreads = 4;
  std::barrier start(kThreads);
  std::atomic<int> decoded = 0;
  std::atomic<int> right = 0;
  std::vector<std::jthread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      start.arrive_and_wait();
      const auto block = cache.heights(column(7), [&] {
        ++decoded;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        return block_of(9);
      });
      if (block && block.value()->at(0, 0) == 9.0f) ++right;
    });
  }
  threads.clear();
  CHECK(decoded == 1);
  CHECK(right == kThreads);
}

TEST_CASE("BlockCache: many threads on few blocks under a small budget always get the right block") {
  BlockCache cache(4 * kBlockBytes);
  const unsigned seed = std::random_device{}();
  MESSAGE("seed " << seed);
  std::atomic<int> wrong = 0;
  std::atomic<bool> over = false;
  std::vector<std::jthread> threads;
  for (unsigned t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      std::mt19937 random(seed + t);
      for (int n = 0; n < 2000; ++n) {
        const auto i = static_cast<std::int32_t>(random() % 12);
        const auto block = cache.heights(column(i), [i] { return block_of(static_cast<float>(i)); });
        if (!block || block.value()->at(1, 1) != static_cast<float>(i)) ++wrong;
        if (cache.bytes() > cache.budget_bytes() + kBlockBytes + kOverhead) over = true;
      }
    });
  }
  threads.clear();
  CHECK(wrong == 0);
  CHECK(!over);
}
