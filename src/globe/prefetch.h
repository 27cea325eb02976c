// Fetching a region's tiles ahead, for use without a network.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "globe/globe.h"
#include "source/raster_source.h"

namespace tellurion::globe {

/// What is to be had.
struct PrefetchArea {
  std::array<double, 4> bounds{-180.0, -90.0, 180.0, 90.0};  ///< west, south, east, north in degrees; west > east: across longitude 180
  std::pair<int, int> zooms{0, 0};         ///< coarsest and finest; see Prefetch::plan
  std::optional<double> metres_per_pixel;  ///< instead of the finest zoom: the coarsest level that is as fine
  std::optional<UtcTime> time;             ///< of layers with times
};

struct PrefetchProgress {
  std::int64_t done = 0;    ///< blocks that are there now, or known to be nowhere
  std::int64_t failed = 0;
  bool stopped = false;
  std::string last_error;
};

/// Reads every block of the network layers once, so that all bytes behind it are in the disk cache. Not thread-safe.
class Prefetch {
 public:
  /// One level of a layer: a rectangle of blocks as large as its tiles.
  struct Part {
    std::size_t source = 0;  ///< index into `sources_`
    std::string layer;
    int zoom = 0;
    int level = 0;           ///< of the raster
    int block = 256;         ///< pixels on a side
    int column = 0, row = 0, columns = 0, rows = 0;

    std::int64_t count() const { return std::int64_t{columns} * rows; }
  };

  /// Finds the blocks. Zooms of "xyz" sources are their own; those of others are counted as Web Mercator's with tiles of 256
  /// pixels: 156,543 m a pixel at the equator at zoom 0, half of that at each further one. `globe` outlives this.
  /// Errors: of opening the sources.
  static Result<Prefetch> plan(const Globe& globe, const PrefetchArea& area);

  const std::vector<Part>& parts() const { return parts_; }
  std::int64_t count() const;
  /// If tiles of 256 pixels have `bytes_per_tile` on average.
  double estimated_bytes(double bytes_per_tile) const;

  /// Until all is done, or `go_on` says no (asked about ten times a second), or kHopeless blocks in a row could not be had.
  /// What could not be had is tried once more at the end.
  PrefetchProgress run(const std::function<bool(const PrefetchProgress&)>& go_on);

  static constexpr int kHopeless = 200;

 private:
  struct Source {
    std::shared_ptr<const source::RasterSource> raster;
    std::unique_ptr<source::RasterReader> reader;
    bool heights = false;
  };
  struct Block {
    std::size_t part = 0;
    std::int64_t number = 0;
    source::Awaited awaited{};
  };
  class Round;

  Prefetch() = default;
  void add_parts(const LayerSpec& spec, std::size_t source, const PrefetchArea& area);
  Result<void> read(const Block& block);

  std::vector<Source> sources_;
  std::vector<Part> parts_;
};

}  // namespace tellurion::globe
