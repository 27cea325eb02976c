#include "source/statistics.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include "fetch/arrival.h"

namespace tellurion::source {
namespace {

constexpr int kBlock = 1024;  ///< pixels on a side, read at a time
constexpr double kNearlyRound = 6.28;  ///< radians from west to east: all of the globe
constexpr std::chrono::seconds kPatience{60};  ///< for a block

/// Mean and deviation in one pass: Welford (1962), doi:10.1080/00401706.1962.10490022.
class Tally {
 public:
  void add(double value) {
    ++count_;
    const double before = value - mean_;
    mean_ += before / count_;
    squares_ += before * (value - mean_);
    least_ = std::min(least_, value);
    largest_ = std::max(largest_, value);
  }
  double count() const { return count_; }
  BandStatistics result() const {
    if (count_ == 0.0) return {NAN, NAN, NAN, NAN};
    return {least_, largest_, mean_, std::sqrt(squares_ / count_)};
  }

 private:
  double count_ = 0.0;
  double mean_ = 0.0;
  double squares_ = 0.0;
  double least_ = std::numeric_limits<double>::infinity();
  double largest_ = -std::numeric_limits<double>::infinity();
};

using Tallies = std::array<Tally, 3>;

Result<void> add_heights(RasterReader& reader, int level, const PixelWindow& window, Tallies& tallies) {
  const Result<raster::HeightGrid> grid = reader.read_heights(level, window);
  if (!grid) return grid.error();
  for (const float metres : grid->metres) {
    if (std::isfinite(metres)) tallies[0].add(static_cast<double>(metres));
  }
  return {};
}

Result<void> add_colours(RasterReader& reader, int level, const PixelWindow& window, Tallies& tallies) {
  const Result<raster::Image> image = reader.read_colours(level, window);
  if (!image) return image.error();
  for (std::size_t i = 0; i < image->rgba.size(); i += 4) {
    const std::uint8_t alpha = image->rgba[i + 3];
    if (alpha == 0) continue;
    for (std::size_t c = 0; c < tallies.size(); ++c) tallies[c].add(image->rgba[i + c] * 255.0 / alpha);  // they are premultiplied
  }
  return {};
}

/// Reads again whenever what was asked for has come.
template <class Read>
Result<void> waiting(RasterReader& reader, const std::string& name, const Read& read) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  for (;;) {
    Result<void> done = read();
    if (done || done.error().code != ErrorCode::pending) return done;
    for (const auto& arrival : reader.take_awaited()) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0 || !arrival->wait_for(left)) return Error{ErrorCode::unavailable, fmt::format("{}: samples did not come within {} s", name, kPatience.count())};
    }
    if (std::chrono::steady_clock::now() > deadline) return Error{ErrorCode::unavailable, fmt::format("{}: samples are not to be had now", name)};
  }
}

/// The part of level 0 in which data lie, in its pixels: of tile services that cover a region all but that is empty.
struct Part {
  glm::dvec2 lower{0.0};
  glm::dvec2 upper{0.0};

  PixelWindow at(const RasterDescription& about, int level) const {
    const LevelSize& full = about.levels.front();
    const LevelSize& size = about.levels[static_cast<std::size_t>(level)];
    const glm::dvec2 scale(static_cast<double>(size.width) / full.width, static_cast<double>(size.height) / full.height);
    const int x = std::min(static_cast<int>(lower.x * scale.x), size.width - 1), y = std::min(static_cast<int>(lower.y * scale.y), size.height - 1);
    return {x, y, std::clamp(static_cast<int>(std::ceil(upper.x * scale.x)) - x, 1, size.width - x), std::clamp(static_cast<int>(std::ceil(upper.y * scale.y)) - y, 1, size.height - y)};
  }
};

Part part_of(RasterReader& reader, const RasterDescription& about) {
  const glm::dvec2 full(about.levels.front().width, about.levels.front().height);
  const geo::GeodeticBounds& bounds = about.bounds;
  if (!about.is_remote || bounds.east.value - bounds.west.value > kNearlyRound) return {glm::dvec2(0.0), full};
  constexpr int kSteps = 16;
  std::vector<geo::LatLon> places;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      places.push_back({Radians(std::lerp(bounds.south.value, bounds.north.value, static_cast<double>(i) / kSteps)),
                        Radians(std::lerp(bounds.west.value, bounds.east.value, static_cast<double>(j) / kSteps))});
    }
  }
  std::vector<glm::dvec2> pixels(places.size());
  reader.to_pixels(places, pixels);
  Part part{full, glm::dvec2(0.0)};
  for (const glm::dvec2& pixel : pixels) {
    if (std::isnan(pixel.x) || std::isnan(pixel.y)) return {glm::dvec2(0.0), full};
    part.lower = glm::min(part.lower, pixel);
    part.upper = glm::max(part.upper, pixel);
  }
  return {glm::clamp(part.lower, glm::dvec2(0.0), full), glm::clamp(part.upper, glm::dvec2(0.0), full)};
}

}  // namespace

Result<RasterStatistics> statistics_of(const RasterSource& source, double most_samples) {
  const RasterDescription& about = source.description();
  if (about.is_remote) most_samples = std::min(most_samples, kMostRemoteSamples);
  Result<std::unique_ptr<RasterReader>> reader = source.open_reader();
  if (!reader) return reader.error();
  const Part part = part_of(**reader, about);
  const auto samples = [](const PixelWindow& window) { return static_cast<double>(window.width) * window.height; };
  const int last = static_cast<int>(about.levels.size()) - 1;
  RasterStatistics statistics;
  while (statistics.level < last && samples(part.at(about, statistics.level)) > most_samples) ++statistics.level;

  const PixelWindow whole = part.at(about, statistics.level);
  Tallies tallies;
  for (int y = 0; y < whole.height; y += kBlock) {
    for (int x = 0; x < whole.width; x += kBlock) {
      const PixelWindow window{whole.x + x, whole.y + y, std::min(kBlock, whole.width - x), std::min(kBlock, whole.height - y)};
      const auto add = about.kind == SampleKind::height ? add_heights : add_colours;
      const Result<void> added = waiting(**reader, about.name, [&] { return add(**reader, statistics.level, window, tallies); });
      if (!added) return added.error();
    }
  }
  statistics.share_there = tallies[0].count() / samples(whole);
  const std::size_t bands = about.kind == SampleKind::colour ? 3 : 1;
  for (std::size_t i = 0; i < bands; ++i) statistics.bands.push_back(tallies[i].result());
  return statistics;
}

}  // namespace tellurion::source
