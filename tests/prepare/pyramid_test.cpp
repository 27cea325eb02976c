#include "prepare/pyramid.h"

#include <algorithm>
#include <map>
#include <random>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::prepare;

TEST_CASE("PyramidStream: strips give the levels that halving the whole gives") {
  constexpr int kStrip = 8, kLastLevel = 3;
  const SampleLayout layout{SampleType::u8, 1, false, 7.0};
  const unsigned seed = std::random_device{}();
  MESSAGE("seed " << seed);
  std::mt19937 random(seed);
  for (const auto& [width, height] : {std::pair{64, 64}, {37, 61}, {1, 17}, {50, 8}, {3, 3}}) {
    Samples whole = make_samples(layout, width, height);
    for (std::byte& one : whole.bytes) one = static_cast<std::byte>(random() % 256);
    std::map<int, Samples> levels;
    PyramidStream stream(layout, width, height, kStrip, kLastLevel, [&](int level, int first_row, const Samples& strip) -> Result<void> {
      Samples& one = levels[level];
      CHECK(one.height == first_row);
      one.width = strip.width;
      one.height += strip.height;
      one.bytes.insert(one.bytes.end(), strip.bytes.begin(), strip.bytes.end());
      return {};
    });
    for (int y = 0; y < height; y += kStrip) {
      const int rows = std::min(kStrip, height - y);
      const auto first = whole.bytes.begin() + static_cast<std::ptrdiff_t>(y) * width;
      REQUIRE(stream.push({width, rows, std::vector<std::byte>(first, first + static_cast<std::ptrdiff_t>(rows) * width)}));
    }
    REQUIRE(levels.size() == kLastLevel + 1);
    for (int level = 0; level <= kLastLevel; ++level) {
      CHECK(levels[level].width == size_at(width, level));
      CHECK(levels[level].height == size_at(height, level));
      CHECK(levels[level].bytes == whole.bytes);
      whole = halve(layout, whole);
    }
  }
}
