// Decoded blocks of rasters under a budget in bytes.
// Thread-safe. A block that two threads want is decoded once: the second waits for the first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "base/frozen.h"
#include "base/result.h"
#include "raster/height_grid.h"
#include "raster/image.h"

namespace tellurion::cache {

inline constexpr int kBlockSide = 256;  ///< samples; blocks at a level's right and lower border are smaller

/// Names a block: which source, which level, which column and row of blocks, of which of its contents.
struct BlockKey {
  std::uint32_t source = 0;
  std::uint32_t level = 0;
  std::int32_t column = 0;
  std::int32_t row = 0;
  std::uint32_t content = 0;  ///< counts up when the source is read anew

  friend bool operator==(const BlockKey&, const BlockKey&) = default;
};

/// What was decoded for a source since the start, and what could not be.
struct SourceReads {
  std::int64_t blocks = 0;
  std::int64_t bytes = 0;  ///< as decoded
  std::int64_t errors = 0;
  std::int64_t lost = 0;   ///< of the errors: those that asking again cannot mend
  std::string last_error;
};

/// What it takes to have a block again.
enum class Remaking {
  dear,   ///< much is read for it, or it cannot be had at all for a while
  cheap,  ///< one small file of this machine
};

/// Least recently used first; holds at most the budget plus one block. Blocks that are cheap to remake keep to a share of it: they are
/// needed for the tiles that lie on them, which are made together, and hardly again.
class BlockCache {
 public:
  /// `cheap_bytes`: that share; no more than all.
  BlockCache(std::size_t budget_bytes, std::size_t cheap_bytes);
  explicit BlockCache(std::size_t budget_bytes) : BlockCache(budget_bytes, budget_bytes) {}
  ~BlockCache();
  BlockCache(const BlockCache&) = delete;
  BlockCache& operator=(const BlockCache&) = delete;

  using DecodeHeights = std::function<Result<raster::HeightGrid>()>;
  using DecodeImage = std::function<Result<raster::Image>()>;

  /// The block, decoded by `decode` if it is not there. An error is passed on and not kept.
  Result<Frozen<raster::HeightGrid>> heights(const BlockKey& key, const DecodeHeights& decode);
  Result<Frozen<raster::Image>> image(const BlockKey& key, const DecodeImage& decode, Remaking remaking = Remaking::dear);

  /// The block if it is there; null otherwise, without waiting for a thread that decodes it.
  Frozen<raster::HeightGrid> resident_heights(const BlockKey& key);

  SourceReads reads_of(std::uint32_t source) const;

  std::size_t bytes() const;
  std::size_t budget_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::cache
