// The file of a chunk that is done: its compressed blocks, the samples of its coarsest level, and its statistics.
// It appears whole or not at all, whatever happens while it is written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "prepare/samples.h"

namespace tellurion::prepare {

struct BlockPlace {
  std::uint64_t offset = 0;
  std::uint32_t bytes = 0;  ///< 0: the block is blank
};

struct ChunkIndex {
  std::vector<std::vector<BlockPlace>> levels;  ///< row by row
  Samples seed;                                 ///< of the coarsest level; its bytes lie at `seed_place`
  BlockPlace seed_place;
  std::vector<BandStatistics> bands;
};

class ChunkWriter {
 public:
  /// Errors: unavailable.
  static Result<ChunkWriter> create(std::filesystem::path file);
  ChunkWriter(ChunkWriter&&) = default;
  ChunkWriter& operator=(ChunkWriter&&) = default;
  /// Removes what was not finished.
  ~ChunkWriter();

  /// The next block of a level, row by row. Errors: unavailable (a full disk, say).
  Result<void> add(int level, std::span<const std::byte> block);
  Result<void> finish(const Samples& seed, const std::vector<BandStatistics>& bands);

 private:
  ChunkWriter(std::filesystem::path file, std::filesystem::path part) : file_(std::move(file)), part_(std::move(part)) {}
  Error failure() const;

  std::filesystem::path file_;
  std::filesystem::path part_;
  std::ofstream stream_;
  std::uint64_t written_ = 0;
  ChunkIndex index_;
};

/// What a chunk's file holds, without the bytes of blocks and seed. Errors: not_found, corrupt.
Result<ChunkIndex> read_chunk_index(const std::filesystem::path& file);

/// Bytes of a file. Errors: unavailable.
Result<std::vector<std::byte>> read_bytes(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t count);

}  // namespace tellurion::prepare
