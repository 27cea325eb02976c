#include "fetch/disk_cache.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sqlite3.h>

#include "base/hash.h"
#include "base/log.h"

namespace tellurion::fetch {
namespace {

constexpr int kVersion = 2;             ///< of the tables
constexpr int kBusyWait_ms = 2000;      ///< for another process
constexpr double kRoomAfterwards = 0.9; ///< share of the budget that is left filled when room is made

struct DatabaseDeleter {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
using Database = std::unique_ptr<sqlite3, DatabaseDeleter>;

struct StatementDeleter {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// A prepared statement, used again and again.
class Statement {
 public:
  Statement() = default;
  Statement(sqlite3* database, const char* text) {
    sqlite3_stmt* made = nullptr;
    sqlite3_prepare_v3(database, text, -1, SQLITE_PREPARE_PERSISTENT, &made, nullptr);
    statement_.reset(made);
  }
  explicit operator bool() const { return statement_ != nullptr; }

  /// Binds in order and takes the first step.
  template <class... Values>
  int run(const Values&... values) {
    sqlite3_reset(statement_.get());
    sqlite3_clear_bindings(statement_.get());
    int place = 0;
    (bind(++place, values), ...);
    return sqlite3_step(statement_.get());
  }
  int next() { return sqlite3_step(statement_.get()); }
  void finish() { sqlite3_reset(statement_.get()); }

  std::int64_t number(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  std::string text(int column) const {
    const void* data = sqlite3_column_blob(statement_.get(), column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
    return data != nullptr ? std::string(static_cast<const char*>(data), size) : std::string();
  }

 private:
  void bind(int place, std::int64_t value) { sqlite3_bind_int64(statement_.get(), place, value); }
  void bind(int place, std::string_view value) {
    sqlite3_bind_text64(statement_.get(), place, value.data(), value.size(), SQLITE_STATIC, SQLITE_UTF8);
  }
  struct Blob {
    std::string_view bytes;
  };
  void bind(int place, const Blob& value) {
    sqlite3_bind_blob64(statement_.get(), place, value.bytes.data(), value.bytes.size(), SQLITE_STATIC);
  }

  std::unique_ptr<sqlite3_stmt, StatementDeleter> statement_;

 public:
  static Blob blob(std::string_view bytes) { return {bytes}; }
};

std::int64_t seconds_of(std::chrono::system_clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::seconds>(time.time_since_epoch()).count();
}

std::int64_t now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::int64_t checksum_of(std::string_view key, std::string_view body) {
  return static_cast<std::int64_t>(fnv1a(body) ^ (fnv1a(key) * 3));
}

/// How opening a file ended.
enum class Opened {
  yes,
  foreign,  ///< no database, a damaged one, or one with other tables
  newer,    ///< made by a later version of the program
  no,       ///< for now: it is in use, may not be read or written, or the disk is full
};

std::filesystem::path aside_of(const std::filesystem::path& file) { return file.string() + ".damaged"; }

}  // namespace

struct DiskCache::State {
  State(std::filesystem::path f, std::size_t budget) : file(std::move(f)), budget_bytes(budget) {}

  const std::filesystem::path file;
  const std::size_t budget_bytes;
  std::atomic<std::int64_t> bytes{0};  ///< written with the mutex held

  mutable std::mutex mutex;  ///< guards what follows
  Database database;
  Statement find, put, drop, use, renew, sum, oldest;
  int status = SQLITE_OK;    ///< of what failed when it was opened
  bool full = false;         ///< the disk, told once

  int execute(const char* text) { return sqlite3_exec(database.get(), text, nullptr, nullptr, nullptr); }
  Opened open();
  Opened failed(int with);
  std::optional<std::int64_t> version();
  std::string why_not(Opened opened) const;
  void make_room();
  void shrink();
  void recount();
};

/// Of the tables: 0 if there are none yet; nothing if it cannot be read.
std::optional<std::int64_t> DiskCache::State::version() {
  Statement version(database.get(), "PRAGMA user_version");
  if (!version || version.run() != SQLITE_ROW) return std::nullopt;
  return version.number(0);
}

Opened DiskCache::State::failed(int with) {
  status = with;
  const int kind = with & 0xff;
  return kind == SQLITE_NOTADB || kind == SQLITE_CORRUPT || kind == SQLITE_ERROR ? Opened::foreign : Opened::no;  // ERROR: no such column
}

std::string DiskCache::State::why_not(Opened opened) const {
  const int kind = status & 0xff;
  if (opened == Opened::newer) return fmt::format("{}: the disk cache was made by a later version of the program; --disk-cache names another folder", file.string());
  if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED) return fmt::format("{}: the disk cache is held by another program", file.string());
  return fmt::format("{}: the disk cache cannot be opened: {}; is the folder there and writable, and is there room?", file.string(), sqlite3_errstr(status));
}

Opened DiskCache::State::open() {
  sqlite3* opened = nullptr;
  const int status_of_open = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  database.reset(opened);
  if (status_of_open != SQLITE_OK) return failed(status_of_open);
  sqlite3_busy_timeout(database.get(), kBusyWait_ms);
  sqlite3_extended_result_codes(database.get(), 1);
  const std::string make = fmt::format(
      "CREATE TABLE IF NOT EXISTS files (key TEXT PRIMARY KEY, body BLOB NOT NULL, missing INTEGER NOT NULL, etag TEXT NOT NULL,"
      " type TEXT NOT NULL, expires INTEGER NOT NULL, used INTEGER NOT NULL, bytes INTEGER NOT NULL, checksum INTEGER NOT NULL,"
      " whole INTEGER NOT NULL DEFAULT 0);"
      "CREATE INDEX IF NOT EXISTS files_used ON files (used, bytes);"
      "PRAGMA user_version = {};", kVersion);
  // A new file takes auto_vacuum only before anything is written, an old one with its next VACUUM.
  if (const int set = execute("PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL;"); set != SQLITE_OK) return failed(set);
  std::optional<std::int64_t> found = version();
  if (found == 1) {
    const int altered = execute("BEGIN IMMEDIATE; ALTER TABLE files ADD COLUMN whole INTEGER NOT NULL DEFAULT 0; PRAGMA user_version = 2; COMMIT");
    if (altered != SQLITE_OK) execute("ROLLBACK");
    found = version();  // another process may have been faster
    if (found == 1) return failed(altered);
  }
  if (!found) return failed(sqlite3_extended_errcode(database.get()));
  if (*found > kVersion) return Opened::newer;
  if (*found < 0) return Opened::foreign;
  if (*found == 0) {
    if (const int made = execute(make.c_str()); made != SQLITE_OK) return failed(made);
  }
  const std::pair<Statement*, const char*> statements[] = {
      {&find, "SELECT body, missing, etag, type, expires, checksum, used, whole FROM files WHERE key = ?"},
      {&put, "INSERT OR REPLACE INTO files (key, body, missing, etag, type, expires, used, bytes, checksum, whole) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"},
      {&drop, "DELETE FROM files WHERE key = ?"},
      {&use, "UPDATE files SET used = ? WHERE key = ?"},
      {&renew, "UPDATE files SET expires = ? WHERE key = ?"},
      {&sum, "SELECT COALESCE(SUM(bytes), 0) FROM files"},  // of the index alone: other columns lie among the bodies
      {&oldest, "SELECT key, bytes FROM files ORDER BY used LIMIT 256"},
  };
  for (const auto& [statement, text] : statements) {
    *statement = Statement(database.get(), text);
    if (!*statement) return failed(sqlite3_extended_errcode(database.get()));
  }
  recount();
  return Opened::yes;
}

void DiskCache::State::recount() {
  if (sum.run() == SQLITE_ROW) bytes = sum.number(0);
  sum.finish();
}

/// Drops the least recently used ones until there is some room again. Other processes write too: counts anew first.
void DiskCache::State::make_room() {
  recount();
  const auto enough = static_cast<std::int64_t>(kRoomAfterwards * static_cast<double>(budget_bytes));
  if (bytes <= static_cast<std::int64_t>(budget_bytes)) return;
  execute("BEGIN IMMEDIATE");
  while (bytes > enough) {
    std::vector<std::pair<std::string, std::int64_t>> old;
    for (int step = oldest.run(); step == SQLITE_ROW; step = oldest.next()) old.emplace_back(oldest.text(0), oldest.number(1));
    oldest.finish();
    if (old.empty()) break;
    for (const auto& [key, size] : old) {
      if (bytes <= enough) break;
      drop.run(std::string_view(key));
      drop.finish();
      bytes -= size;
    }
  }
  execute("COMMIT");
  shrink();
}

/// Gives pages back to the system, except those that will soon be filled again.
void DiskCache::State::shrink() {
  Statement unused(database.get(), "SELECT freelist_count, page_size FROM pragma_freelist_count, pragma_page_size");
  if (!unused || unused.run() != SQLITE_ROW) return;
  const std::int64_t room = static_cast<std::int64_t>((1.0 - kRoomAfterwards) * static_cast<double>(budget_bytes)), pages = unused.number(0) - room / unused.number(1);
  unused.finish();
  if (pages > 0) execute(fmt::format("PRAGMA incremental_vacuum({})", pages).c_str());
}

DiskCache::DiskCache(std::unique_ptr<State> state) : state_(std::move(state)) {}
DiskCache::~DiskCache() = default;

Result<std::unique_ptr<DiskCache>> DiskCache::open(const std::filesystem::path& file, std::size_t budget_bytes) {
  auto state = std::make_unique<State>(file, budget_bytes);
  std::error_code failure;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failure);
  Opened opened = state->open();
  if (opened == Opened::foreign) {
    state = std::make_unique<State>(file, budget_bytes);  // lets go of the file
    std::filesystem::rename(file, aside_of(file), failure);
    if (!failure) {
      for (const char* more : {"-wal", "-shm"}) std::filesystem::remove(file.string() + more, failure);
      log::warning(fmt::format("{}: no readable cache; it was set aside as {} and begun anew", file.string(), aside_of(file).string()));
    }
    opened = state->open();
  }
  if (opened != Opened::yes) return Error{ErrorCode::unavailable, state->why_not(opened)};
  return std::unique_ptr<DiskCache>(new DiskCache(std::move(state)));
}

std::optional<DiskEntry> DiskCache::find(std::string_view key) {
  constexpr std::int64_t kUseEvery_ms = 60'000;  // a read that writes each time would be slow
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  if (s.find.run(key) != SQLITE_ROW) {
    s.find.finish();
    return std::nullopt;
  }
  DiskEntry entry{s.find.text(0), s.find.number(1) != 0, s.find.text(2), s.find.text(3),
                  std::chrono::system_clock::time_point(std::chrono::seconds(s.find.number(4))), static_cast<std::uint64_t>(s.find.number(7))};
  const std::int64_t checksum = s.find.number(5), used = s.find.number(6);
  s.find.finish();
  if (checksum != checksum_of(key, entry.body)) {
    s.drop.run(key);
    s.drop.finish();
    return std::nullopt;
  }
  if (const std::int64_t now = now_ms(); now - used > kUseEvery_ms) {
    s.use.run(now, key);
    s.use.finish();
  }
  return entry;
}

bool DiskCache::put(std::string_view key, const DiskEntry& entry) {
  State& s = *state_;
  if (entry.body.size() > s.budget_bytes / 4) return false;
  std::lock_guard lock(s.mutex);
  const auto size = static_cast<std::int64_t>(entry.body.size() + key.size());
  const int status = s.put.run(key, Statement::blob(entry.body), std::int64_t{entry.missing}, std::string_view(entry.etag),
                               std::string_view(entry.content_type), seconds_of(entry.expires), now_ms(), size, checksum_of(key, entry.body), static_cast<std::int64_t>(entry.whole_bytes));
  s.put.finish();
  if (status != SQLITE_DONE) {
    if (!std::exchange(s.full, true)) log::warning(fmt::format("{}: {}; what is fetched is not kept", s.file.string(), sqlite3_errstr(status)));
    return false;
  }
  s.bytes += size;
  if (s.bytes > static_cast<std::int64_t>(s.budget_bytes)) s.make_room();
  return true;
}

void DiskCache::remove(std::string_view key) {
  std::lock_guard lock(state_->mutex);
  state_->drop.run(key);
  state_->drop.finish();
}

void DiskCache::renew(std::string_view key, std::chrono::system_clock::time_point expires) {
  std::lock_guard lock(state_->mutex);
  state_->renew.run(seconds_of(expires), key);
  state_->renew.finish();
}

DiskCache::Contents DiskCache::contents() const {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  Contents contents;
  Statement all(s.database.get(), "SELECT COUNT(*), COALESCE(SUM(bytes), 0), COALESCE(SUM(missing), 0) FROM files");
  if (all && all.run() == SQLITE_ROW) contents = {all.number(0), all.number(1), all.number(2)};
  return contents;
}

void DiskCache::clear() {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  s.execute("DELETE FROM files");
  s.execute("VACUUM");
  s.execute("PRAGMA wal_checkpoint(TRUNCATE)");
  std::error_code failure;
  std::filesystem::remove(aside_of(s.file), failure);
  s.recount();
}

std::int64_t DiskCache::verify() {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  std::vector<std::string> wrong;
  Statement all(s.database.get(), "SELECT key, body, checksum FROM files");
  for (int step = all.run(); step == SQLITE_ROW; step = all.next()) {
    const std::string key = all.text(0);
    if (all.number(2) != checksum_of(key, all.text(1))) wrong.push_back(key);
  }
  all.finish();
  for (const std::string& key : wrong) {
    s.drop.run(std::string_view(key));
    s.drop.finish();
  }
  s.recount();
  return static_cast<std::int64_t>(wrong.size());
}

std::size_t DiskCache::bytes() const { return static_cast<std::size_t>(std::max<std::int64_t>(state_->bytes, 0)); }

}  // namespace tellurion::fetch
