#include "prepare/plane.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

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

}  // namespace

TEST_CASE("plane_of: no-data and what is not opaque are void") {
  const Plane heights = plane_of({SampleType::i16, 1, false, -32768.0}, samples_of<std::int16_t>(2, 1, {-32768, 5}), 0);
  CHECK(std::isnan(heights.at(0, 0)));
  CHECK(heights.at(1, 0) == 5.0F);
  const Plane grey = plane_of({SampleType::u8, 2, true, {}}, samples_of<std::uint8_t>(3, 1, {10, 255, 20, 254, 30, 0}), 0);
  CHECK(grey.at(0, 0) == 10.0F);
  CHECK(std::isnan(grey.at(1, 0)));
  CHECK(std::isnan(grey.at(2, 0)));
}

TEST_CASE("fill_band: only voids take the plane's values, rounded, in range and never the void's value") {
  Samples samples = samples_of<std::int16_t>(4, 1, {-9999, 5, -9999, -9999});
  fill_band({SampleType::i16, 1, false, -9999.0}, samples, 0, {4, 1, {2.5F, 7.0F, 1e9F, -9999.2F}});
  CHECK(values_of<std::int16_t>(samples) == std::vector<std::int16_t>{3, 5, 32767, -9998});
}

TEST_CASE("fill_band: a pixel that is partly transparent lies over the plane") {
  Samples samples = samples_of<std::uint8_t>(3, 1, {200, 51, 200, 255, 200, 0});
  fill_band({SampleType::u8, 2, true, {}}, samples, 0, {3, 1, {100.0F, 100.0F, std::nanf("")}});
  CHECK(values_of<std::uint8_t>(samples) == std::vector<std::uint8_t>{120, 51, 200, 255, 200, 0});
}

TEST_CASE("cut_window: rows and columns of the window alone") {
  const Samples window = cut_window({SampleType::u8, 1, false, {}}, samples_of<std::uint8_t>(3, 2, {1, 2, 3, 4, 5, 6}), 1, 1, 2, 1);
  CHECK(values_of<std::uint8_t>(window) == std::vector<std::uint8_t>{5, 6});
}
