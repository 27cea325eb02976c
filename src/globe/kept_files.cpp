#include "globe/kept_files.h"

#include <limits>
#include <memory>
#include <system_error>

#include "fetch/disk_cache.h"

namespace tellurion::globe {
namespace {

constexpr const char* kFolders[] = {"tables", "unpacked"};

/// The database as it is; null if there is none.
Result<std::unique_ptr<fetch::DiskCache>> open_kept(const std::filesystem::path& cache_folder) {
  std::error_code failure;
  const std::filesystem::path file = kept_database(cache_folder);
  if (!std::filesystem::exists(file, failure)) return std::unique_ptr<fetch::DiskCache>();
  return fetch::DiskCache::open(file, std::numeric_limits<std::int64_t>::max());
}

std::int64_t bytes_in(const std::filesystem::path& folder) {
  std::int64_t bytes = 0;
  std::error_code failure;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failure)) {
    const auto size = entry.file_size(failure);
    if (!failure) bytes += static_cast<std::int64_t>(size);
  }
  return bytes;
}

}  // namespace

std::filesystem::path kept_database(const std::filesystem::path& cache_folder) { return cache_folder / "files.sqlite"; }

Result<KeptFiles> kept_files(const std::filesystem::path& cache_folder) {
  const auto cache = open_kept(cache_folder);
  if (!cache) return cache.error();
  KeptFiles kept;
  if (*cache) {
    const fetch::DiskCache::Contents contents = (*cache)->contents();
    kept = {contents.entries, contents.bytes, contents.missing};
  }
  kept.table_bytes = bytes_in(cache_folder / kFolders[0]);
  kept.unpacked_bytes = bytes_in(cache_folder / kFolders[1]);
  return kept;
}

Result<std::int64_t> verify_kept_files(const std::filesystem::path& cache_folder) {
  const auto cache = open_kept(cache_folder);
  if (!cache) return cache.error();
  return *cache ? (*cache)->verify() : 0;
}

Result<void> clear_kept_files(const std::filesystem::path& cache_folder) {
  const auto cache = open_kept(cache_folder);
  if (!cache) return cache.error();
  if (*cache) (*cache)->clear();
  for (const char* name : kFolders) {
    std::error_code failure;
    std::filesystem::remove_all(cache_folder / name, failure);
    if (failure) return Error{ErrorCode::unavailable, (cache_folder / name).string() + ": " + failure.message()};
  }
  return {};
}

}  // namespace tellurion::globe
