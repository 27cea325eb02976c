// One worker's view of a raster through the block cache: samples at continuous pixel coordinates.
// Not thread-safe (holds a reader and the last blocks); the cache behind it is shared.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "cache/block_cache.h"
#include "source/raster_source.h"

namespace tellurion::cache {

/// A height and how much of it is data: 1 where all neighbouring samples are valid, falling linearly to 0 across the cell
/// next to a void, and across one pixel beyond the raster's border.
struct HeightSample {
  double metres = 0.0;  ///< mean of the valid neighbours by their bilinear weights, as GDAL has it; 0 if coverage is 0
  double coverage = 0.0;
};

class CachedRaster {
 public:
  /// `source` and `cache` outlive this. `id` and `content` are those of the cache's keys.
  static Result<CachedRaster> open(const source::RasterSource& source, BlockCache& cache, std::uint32_t id, std::uint32_t content = 0);

  const source::RasterDescription& description() const { return source_->description(); }
  source::RasterReader& reader() { return *reader_; }

  /// Whether a read since the last call met blocks that are on their way, and what brings them.
  /// Heights that are not there yet read as 0, so that all that is wanted is asked for at once; colours answer `pending`.
  bool take_pending(source::Awaited& awaited);
  bool is_pending() const { return pending_; }

  /// From now on heights are those of blocks in memory: others count as on their way, but nothing is read and nothing asked for.
  void read_nothing() { reads_ = false; }

  /// Bilinear heights at `pixels` (continuous, of level 0), from the samples of `level`.
  /// Between 0.5 pixels inside and the border the outermost samples are continued. NaN pixels: coverage 0.
  Result<void> sample_heights(int level, std::span<const glm::dvec2> pixels, std::span<HeightSample> heights);

  /// Nearest sample of level 0; coverage 0 or 1.
  Result<HeightSample> nearest_height(glm::dvec2 pixel);

  /// The pixels of `window` at `level`; what lies outside the raster repeats its border, or wraps round where it wraps.
  Result<raster::Image> read_colours(int level, const source::PixelWindow& window);

 private:
  CachedRaster() = default;
  /// The block that sampling is in: cells between the centres of its samples need no other.
  struct BlockView {
    const float* samples = nullptr;
    int width = 0;
    int column = 0;
    int row = 0;
    glm::dvec2 first_centre{0.0};
    glm::dvec2 last_cell{0.0};  ///< from `first_centre`
  };
  Result<Frozen<raster::HeightGrid>> resident(const BlockKey& key) const;
  Result<const raster::HeightGrid*> height_block(int level, int column, int row);
  Result<HeightSample> sample_anywhere(int level, glm::dvec2 pixel, BlockView& view);

  const source::RasterSource* source_ = nullptr;
  std::unique_ptr<source::RasterReader> reader_;
  BlockCache* cache_ = nullptr;
  std::uint32_t id_ = 0;
  std::uint32_t content_ = 0;
  struct Held {
    BlockKey key;
    Frozen<raster::HeightGrid> block;
  };
  std::vector<Held> held_;  ///< the last blocks used, few
  bool reads_ = true;
  bool pending_ = false;
  std::vector<Held> absent_;  ///< zeros in the place of blocks on their way
};

}  // namespace tellurion::cache
