#include "prepare/samples.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <doctest/doctest.h>

using namespace tellurion::prepare;

namespace {

template <class T>
Samples samples_of(int width, int height, const std::vector<T>& values) {
  Samples samples{width, height, std::vector<std::byte>(values.size() * sizeof(T))};
  std::memcpy(samples.bytes.data(), values.data(), samples.bytes.size());
  return samples;
}

template <class T>
std::vector<T> values_of(const Samples& samples) {
  std::vector<T> values(samples.bytes.size() / sizeof(T));
  std::memcpy(values.data(), samples.bytes.data(), samples.bytes.size());
  return values;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("halve: the mean of four, of what there is at odd edges") {
  const Samples coarse = halve({SampleType::f32, 1, false, {}}, samples_of<float>(3, 3, {1, 3, 7, 5, 7, 9, 2, 4, 100}));
  CHECK(coarse.width == 2);
  CHECK(coarse.height == 2);
  CHECK(values_of<float>(coarse) == std::vector<float>{4, 8, 3, 100});
}

TEST_CASE("halve: voids are left out, and stay where there is nothing else") {
  const Samples coarse = halve({SampleType::f32, 1, false, -9999.0}, samples_of<float>(4, 2, {-9999, 3, -9999, kNan, 5, 7, -9999, -9999}));
  CHECK(values_of<float>(coarse) == std::vector<float>{5, -9999});
}

TEST_CASE("halve: integers are rounded half up, below zero too") {
  CHECK(values_of<std::int16_t>(halve({SampleType::i16, 1, false, {}}, samples_of<std::int16_t>(4, 1, {1, 2, -1, -2}))) == std::vector<std::int16_t>{2, -1});
  CHECK(values_of<std::int16_t>(halve({SampleType::i16, 1, false, {}}, samples_of<std::int16_t>(2, 2, {-1, -1, -1, -2}))) == std::vector<std::int16_t>{-1});
}

TEST_CASE("halve: colours count by their alpha") {
  const Samples coarse = halve({SampleType::u8, 2, true, {}}, samples_of<std::uint8_t>(2, 2, {100, 255, 200, 0, 50, 0, 100, 255}));
  CHECK(values_of<std::uint8_t>(coarse) == std::vector<std::uint8_t>{100, 128});
}

TEST_CASE("cut_block: what lies beyond the edges repeats them") {
  const Samples block = cut_block({SampleType::u8, 1, false, {}}, samples_of<std::uint8_t>(3, 1, {1, 2, 3}), 2, 0, 2);
  CHECK(values_of<std::uint8_t>(block) == std::vector<std::uint8_t>{3, 3, 3, 3});
}

TEST_CASE("is_blank: what a reader shows where there is no block") {
  CHECK(is_blank({SampleType::f32, 1, false, {}}, samples_of<float>(2, 1, {0, 0})));
  CHECK_FALSE(is_blank({SampleType::f32, 1, false, {}}, samples_of<float>(2, 1, {kNan, kNan})));
  CHECK_FALSE(is_blank({SampleType::f32, 1, false, -9999.0}, samples_of<float>(2, 1, {0, 0})));
  CHECK(is_blank({SampleType::f32, 1, false, -9999.0}, samples_of<float>(2, 1, {-9999, -9999})));
  CHECK(is_blank({SampleType::f32, 1, false, std::nan("")}, samples_of<float>(2, 1, {kNan, kNan})));
}

TEST_CASE("clean: what is not finite becomes void") {
  Samples samples = samples_of<float>(3, 1, {1, kNan, std::numeric_limits<float>::infinity()});
  clean({SampleType::f32, 1, false, -1.0}, samples);
  CHECK(values_of<float>(samples) == std::vector<float>{1, -1, -1});
}

TEST_CASE("statistics: of what is not void") {
  const auto found = statistics({SampleType::i16, 1, false, -32768.0}, samples_of<std::int16_t>(4, 1, {-3, -32768, 5, 1}));
  CHECK(found[0].least == -3);
  CHECK(found[0].most == 5);
  CHECK(found[0].sum == 3);
  CHECK(found[0].count == 3);
}
