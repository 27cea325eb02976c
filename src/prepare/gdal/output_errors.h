// The error table of what was prepared: made of the output itself, with all its levels, part by part; parts that are done are kept
// in the work folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "base/result.h"
#include "prepare/ingest.h"

namespace tellurion::prepare {

struct ErrorTableOptions {
  std::optional<bool> wanted{};   ///< as of IngestOptions
  std::size_t memory_bytes = 0;   ///< for the block caches, GDAL's and ours, and all workers
  int workers = 1;
};

/// Whether a table was made: not if it is not wanted, `out` has no heights, or the table is there already.
/// A table of an earlier output that is not made again is removed. Errors: those of reading `out`; unavailable (what cannot be written); cancelled.
Result<bool> make_error_table(const std::filesystem::path& out, const std::filesystem::path& folder, const ErrorTableOptions& options, const IngestWatch& watch);

}  // namespace tellurion::prepare
