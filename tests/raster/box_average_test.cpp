#include "raster/box_average.h"

#include <cmath>

#include <doctest/doctest.h>

using namespace tellurion::raster;

namespace {

HeightGrid grid_of(int width, int height, std::vector<float> metres) { return {width, height, std::move(metres)}; }

}  // namespace

TEST_CASE("BoxAverage: halving takes the mean of four samples") {
  BoxAverage average({2, 1, 0.0, 0.0, 2.0, 2.0});
  average.add(grid_of(4, 2, {1, 2, 10, 20, 3, 6, 30, 40}), 0, 0);
  const HeightGrid coarse = average.heights();
  CHECK(coarse.at(0, 0) == 3.0f);
  CHECK(coarse.at(1, 0) == 25.0f);
}

TEST_CASE("BoxAverage: void samples count for nothing, and only voids make a void") {
  BoxAverage average({2, 1, 0.0, 0.0, 2.0, 1.0});
  average.add(grid_of(4, 1, {kNoHeight, 7, kNoHeight, kNoHeight}), 0, 0);
  const HeightGrid coarse = average.heights();
  CHECK(coarse.at(0, 0) == 7.0f);
  CHECK(std::isnan(coarse.at(1, 0)));
}

TEST_CASE("BoxAverage: a sample cut by a border counts by its part on either side") {
  BoxAverage average({2, 1, 0.0, 0.0, 1.5, 1.0});
  average.add(grid_of(3, 1, {3, 6, 12}), 0, 0);
  const HeightGrid coarse = average.heights();
  CHECK(coarse.at(0, 0) == doctest::Approx((3 * 1.0 + 6 * 0.5) / 1.5));
  CHECK(coarse.at(1, 0) == doctest::Approx((6 * 0.5 + 12 * 1.0) / 1.5));
}

TEST_CASE("BoxAverage: strips give what the whole grid gives, also for a window inside it") {
  std::vector<float> metres;
  for (int i = 0; i < 12 * 9; ++i) metres.push_back(static_cast<float>((i * 37) % 101));
  const BoxLayout layout{2, 2, 3.4, 2.2, 3.4, 2.2};
  BoxAverage whole(layout);
  whole.add(grid_of(12, 9, metres), 0, 0);
  BoxAverage strips(layout);
  for (int row = 2; row < 9; row += 2) {  // columns 3 to 11 only
    HeightGrid strip{9, std::min(2, 9 - row), {}};
    for (int y = row; y < row + strip.height; ++y) {
      strip.metres.insert(strip.metres.end(), metres.begin() + y * 12 + 3, metres.begin() + y * 12 + 12);
    }
    strips.add(strip, 3, row);
  }
  for (int i = 0; i < 4; ++i) CHECK(strips.heights().at(i % 2, i / 2) == doctest::Approx(whole.heights().at(i % 2, i / 2)));
}

TEST_CASE("BoxAverage: premultiplied colours keep their hue beside transparent pixels") {
  BoxAverage average({1, 1, 0.0, 0.0, 2.0, 1.0});
  average.add(Image{2, 1, {200, 100, 50, 255, 0, 0, 0, 0}}, 0, 0);
  CHECK(average.image().at(0, 0) == std::array<std::uint8_t, 4>{100, 50, 25, 128});
}
