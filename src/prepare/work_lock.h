// Who works in a work folder: runs that would disturb one another are told so. The kernel lets go of a lock when its process ends,
// however that comes about.
#pragma once

#include <filesystem>

#include "base/result.h"

namespace tellurion::prepare {

/// Held while it lives. One process for the whole work or for joining; or many, each for another shard.
class WorkLock {
 public:
  /// Errors: unavailable (somebody else works there). Without a lock on file systems that have none.
  static Result<WorkLock> whole(const std::filesystem::path& folder);
  static Result<WorkLock> shard(const std::filesystem::path& folder, int shard, int shards);

  WorkLock(WorkLock&& other) noexcept;
  WorkLock& operator=(WorkLock&& other) noexcept;
  ~WorkLock();

 private:
  WorkLock() = default;

  int folder_ = -1;  ///< file descriptors; -1: none
  int shard_ = -1;
};

}  // namespace tellurion::prepare
