// Encoded files on disk, by key, within a budget in bytes: one SQLite database that several processes may share.
// Thread-safe. What was being written when a process died is not there; a damaged file is never given out.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace tellurion::fetch {

struct DiskEntry {
  std::string body;             ///< empty for `missing`
  bool missing = false;         ///< the server says that there is no such file
  std::string etag;
  std::string content_type;
  std::chrono::system_clock::time_point expires;
  std::uint64_t whole_bytes = 0; ///< of the file of which `body` is a part; 0: it is none
};

class DiskCache {
 public:
  /// Opens or makes the database. A file that is no database, or a damaged one, is set aside as FILE.damaged and made anew.
  /// Errors: unavailable, naming the file and why: another program holds it, there is no room, a later version made it, ...
  static Result<std::unique_ptr<DiskCache>> open(const std::filesystem::path& file, std::size_t budget_bytes);
  ~DiskCache();
  DiskCache(const DiskCache&) = delete;
  DiskCache& operator=(const DiskCache&) = delete;

  /// The entry, however old. Counts as a use. One whose checksum is wrong is dropped.
  std::optional<DiskEntry> find(std::string_view key);
  /// Keeps an entry; the least recently used ones go when the budget is exceeded. If the disk is full nothing is kept,
  /// nor ever what takes more than a quarter of the budget. Whether it is kept.
  bool put(std::string_view key, const DiskEntry& entry);
  void remove(std::string_view key);
  /// A later time to expire, for what the server says has not changed.
  void renew(std::string_view key, std::chrono::system_clock::time_point expires);

  struct Contents {
    std::int64_t entries = 0;
    std::int64_t bytes = 0;     ///< of bodies
    std::int64_t missing = 0;
  };
  /// Reads the whole database.
  Contents contents() const;
  void clear();  ///< FILE.damaged goes as well
  /// Reads everything; drops entries whose checksum is wrong and tells how many.
  std::int64_t verify();
  std::size_t bytes() const;    ///< of bodies, as far as this process knows; waits for nothing

 private:
  struct State;
  explicit DiskCache(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::fetch
