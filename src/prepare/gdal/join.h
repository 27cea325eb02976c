// Joins the chunks that are done into one file, and makes the coarsest levels from them.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

/// Where the plan's chunks lie; folders are searched in order. An empty path: nothing is there, and nothing needs to be.
/// Errors: not_found, saying how many are missing.
Result<std::vector<std::filesystem::path>> find_chunks(const OutputPlan& plan, const std::vector<std::filesystem::path>& folders);

/// Writes `out`, whole or not at all. The coarsest levels are kept in `folder`. Gives the file's length.
/// Errors: corrupt (a chunk), unavailable (what cannot be written).
Result<std::uint64_t> join_chunks(const OutputPlan& plan, const std::vector<std::filesystem::path>& chunks, const std::filesystem::path& folder,
                                  const std::filesystem::path& out, int workers);

}  // namespace tellurion::prepare
