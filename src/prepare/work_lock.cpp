#include "prepare/work_lock.h"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

namespace tellurion::prepare {
namespace {

/// A locked file's descriptor, -1 where files cannot be locked. Errors: unavailable (it is locked).
Result<int> locked(const std::filesystem::path& file, int how, const std::filesystem::path& folder) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0 || ::flock(descriptor, how | LOCK_NB) == 0) return descriptor;
  const bool is_taken = errno == EWOULDBLOCK;
  ::close(descriptor);
  if (!is_taken) return -1;
  return Error{ErrorCode::unavailable, fmt::format("{}: another `tellurion ingest` is at work there; wait until it has ended, or end it", folder.string())};
}

void release(int descriptor) {
  if (descriptor >= 0) ::close(descriptor);
}

}  // namespace

Result<WorkLock> WorkLock::whole(const std::filesystem::path& folder) {
  WorkLock lock;
  const Result<int> taken = locked(folder / "lock", LOCK_EX, folder);
  if (!taken) return taken.error();
  lock.folder_ = *taken;
  return lock;
}

Result<WorkLock> WorkLock::shard(const std::filesystem::path& folder, int shard, int shards) {
  WorkLock lock;
  const Result<int> beside = locked(folder / "lock", LOCK_SH, folder);
  if (!beside) return beside.error();
  lock.folder_ = *beside;
  const Result<int> own = locked(folder / fmt::format("lock-{}-of-{}", shard + 1, shards), LOCK_EX, folder);
  if (!own) return own.error();
  lock.shard_ = *own;
  return lock;
}

WorkLock::WorkLock(WorkLock&& other) noexcept : folder_(std::exchange(other.folder_, -1)), shard_(std::exchange(other.shard_, -1)) {}

WorkLock& WorkLock::operator=(WorkLock&& other) noexcept {
  std::swap(folder_, other.folder_);
  std::swap(shard_, other.shard_);
  return *this;
}

WorkLock::~WorkLock() {
  release(folder_);
  release(shard_);
}

}  // namespace tellurion::prepare
