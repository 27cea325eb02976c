// What the cache folder holds between runs: files from servers, error tables, unpacked rasters.
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"

namespace tellurion::globe {

/// Where files from servers are kept in a cache folder.
std::filesystem::path kept_database(const std::filesystem::path& cache_folder);

struct KeptFiles {
  std::int64_t files = 0;           ///< from servers
  std::int64_t file_bytes = 0;
  std::int64_t missing = 0;         ///< of them: notes that a server has no such file
  std::int64_t table_bytes = 0;
  std::int64_t unpacked_bytes = 0;
};

/// What there is; all 0 where there is no such folder. Errors: unavailable, naming the file.
Result<KeptFiles> kept_files(const std::filesystem::path& cache_folder);

/// Reads every file from a server, drops those that are damaged and tells how many. Errors likewise.
Result<std::int64_t> verify_kept_files(const std::filesystem::path& cache_folder);

/// Removes all of it; running programs go on. Errors likewise.
Result<void> clear_kept_files(const std::filesystem::path& cache_folder);

}  // namespace tellurion::globe
