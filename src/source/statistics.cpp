#include "source/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include <fmt/format.h>

namespace tellurion::source {
namespace {

constexpr int kBlock = 1024;  // pixels on a side, read at a time

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

}  // namespace

Result<RasterStatistics> statistics_of(const RasterSource& source, double most_samples) {
  const RasterDescription& about = source.description();
  if (about.is_remote) return Error{ErrorCode::unsupported, fmt::format("{} is on a server: its samples are not read as a whole", about.name)};
  RasterStatistics statistics;
  const auto samples = [&](int level) {
    const LevelSize& size = about.levels[static_cast<std::size_t>(level)];
    return static_cast<double>(size.width) * size.height;
  };
  const int last = static_cast<int>(about.levels.size()) - 1;
  while (statistics.level < last && samples(statistics.level) > most_samples) ++statistics.level;

  Result<std::unique_ptr<RasterReader>> reader = source.open_reader();
  if (!reader) return reader.error();
  const LevelSize& size = about.levels[static_cast<std::size_t>(statistics.level)];
  Tallies tallies;
  for (int y = 0; y < size.height; y += kBlock) {
    for (int x = 0; x < size.width; x += kBlock) {
      const PixelWindow window{x, y, std::min(kBlock, size.width - x), std::min(kBlock, size.height - y)};
      const Result<void> added = about.kind == SampleKind::height ? add_heights(**reader, statistics.level, window, tallies)
                                                                  : add_colours(**reader, statistics.level, window, tallies);
      if (!added) return added.error();
    }
  }
  statistics.share_there = tallies[0].count() / samples(statistics.level);
  const std::size_t bands = about.kind == SampleKind::colour ? 3 : 1;
  for (std::size_t i = 0; i < bands; ++i) statistics.bands.push_back(tallies[i].result());
  return statistics;
}

}  // namespace tellurion::source
