#include "source/catalogue/footprint_store.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "base/hash.h"
#include "base/log.h"

namespace tellurion::source {
namespace {

constexpr int kVersion = 1;                      ///< of the table
constexpr int kBusyMilliseconds = 2000;          ///< to wait for another process
constexpr std::int64_t kMostKept = 2'000'000;    ///< footprints; the oldest ones go
constexpr std::size_t kMostPlaces = 1 << 16;     ///< of a ring
constexpr std::size_t kPlaceBytes = 16;

struct DatabaseDeleter {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct StatementDeleter {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, StatementDeleter>;

/// Free for the next use at the end of the scope.
class InUse {
 public:
  explicit InUse(const Statement& statement) : statement_(statement.get()) {}
  ~InUse() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  InUse(const InUse&) = delete;
  InUse& operator=(const InUse&) = delete;

  // Texts and blobs outlive the use.
  void bind(int place, std::string_view text) { sqlite3_bind_text64(statement_, place, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8); }
  void bind_blob(int place, std::string_view bytes) { sqlite3_bind_blob64(statement_, place, bytes.data(), bytes.size(), SQLITE_STATIC); }
  void bind(int place, std::int64_t number) { sqlite3_bind_int64(statement_, place, number); }
  int step() { return sqlite3_step(statement_); }
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }
  std::string_view blob(int column) const {
    const void* data = sqlite3_column_blob(statement_, column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    return data != nullptr ? std::string_view(static_cast<const char*>(data), size) : std::string_view();
  }

 private:
  sqlite3_stmt* statement_;
};

bool is_damage(int status) { return (status & 0xff) == SQLITE_CORRUPT || (status & 0xff) == SQLITE_NOTADB; }

// --- A footprint as bytes: little-endian doubles, first the spacing, then latitude and longitude of each place ---------

void append(std::string& bytes, double number) {
  auto bits = std::bit_cast<std::uint64_t>(number);
  for (int i = 0; i < 8; ++i, bits >>= 8) bytes += static_cast<char>(bits & 0xff);
}

double double_at(std::string_view bytes, std::size_t at) {
  std::uint64_t bits = 0;
  for (std::size_t i = 8; i-- > 0;) bits = bits << 8 | static_cast<unsigned char>(bytes[at + i]);
  return std::bit_cast<double>(bits);
}

std::string bytes_of(const KeptFootprint& footprint) {
  std::string bytes;
  bytes.reserve(8 + kPlaceBytes * footprint.ring.size());
  append(bytes, footprint.spacing.value);
  for (const geo::LatLon& place : footprint.ring) {
    append(bytes, place.latitude.value);
    append(bytes, place.longitude.value);
  }
  return bytes;
}

/// Nothing if the bytes are of the wrong length or hold what is no number.
std::optional<KeptFootprint> footprint_of(std::string_view bytes) {
  if (bytes.size() < 8 || (bytes.size() - 8) % kPlaceBytes != 0 || (bytes.size() - 8) / kPlaceBytes > kMostPlaces) return std::nullopt;
  KeptFootprint footprint;
  footprint.spacing = Metres(double_at(bytes, 0));
  if (!std::isfinite(footprint.spacing.value)) return std::nullopt;
  for (std::size_t at = 8; at < bytes.size(); at += kPlaceBytes) {
    const geo::LatLon place{Radians(double_at(bytes, at)), Radians(double_at(bytes, at + 8))};
    if (!std::isfinite(place.latitude.value) || !std::isfinite(place.longitude.value)) return std::nullopt;
    footprint.ring.push_back(place);
  }
  return footprint;
}

std::int64_t checksum_of(std::string_view path, std::string_view revision, std::string_view bytes) {
  return std::bit_cast<std::int64_t>(fnv1a(bytes) ^ (fnv1a(path) * 3) ^ (fnv1a(revision) * 5));
}

/// How opening a file ended.
enum class Opened {
  yes,
  foreign,  ///< no database, a damaged one, or one with other tables
  newer,    ///< made by a later version of the program
  no,       ///< for now: it is in use, may not be read or written, or the disk is full
};

/// An open database and what is asked of it.
struct Tables {
  std::unique_ptr<sqlite3, DatabaseDeleter> database;
  Statement find, put, forget;

  int execute(const char* text) { return sqlite3_exec(database.get(), text, nullptr, nullptr, nullptr); }
  int prepare(Statement& statement, const char* text) {
    sqlite3_stmt* made = nullptr;
    const int status = sqlite3_prepare_v3(database.get(), text, -1, SQLITE_PREPARE_PERSISTENT, &made, nullptr);
    statement.reset(made);
    return status;
  }
  Opened open(const std::filesystem::path& file, int& status);
};

Opened Tables::open(const std::filesystem::path& file, int& status) {
  const auto failed = [&] {
    const int kind = status & 0xff;
    return is_damage(status) || kind == SQLITE_ERROR ? Opened::foreign : Opened::no;  // ERROR: no such column
  };
  sqlite3* opened = nullptr;
  status = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  database.reset(opened);
  if (status != SQLITE_OK) return failed();
  sqlite3_busy_timeout(database.get(), kBusyMilliseconds);
  sqlite3_extended_result_codes(database.get(), 1);
  if (status = execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL;"); status != SQLITE_OK) return failed();
  Statement asked;
  if (status = prepare(asked, "PRAGMA user_version"); status != SQLITE_OK) return failed();
  std::int64_t version = 0;
  {
    InUse use(asked);
    if (status = use.step(); status != SQLITE_ROW) return failed();
    version = use.number(0);
  }
  if (version > kVersion) return Opened::newer;
  if (version < 0) return Opened::foreign;
  if (version == 0) {
    const std::string make = fmt::format("CREATE TABLE IF NOT EXISTS footprints (path TEXT PRIMARY KEY, revision TEXT NOT NULL, footprint BLOB NOT NULL,"
                                         " checksum INTEGER NOT NULL); PRAGMA user_version = {};", kVersion);
    if (status = execute(make.c_str()); status != SQLITE_OK) return failed();
  }
  const std::array<std::pair<Statement*, const char*>, 3> statements{{
      {&find, "SELECT footprint, checksum FROM footprints WHERE path = ? AND revision = ?"},
      {&put, "INSERT OR REPLACE INTO footprints (path, revision, footprint, checksum) VALUES (?, ?, ?, ?)"},
      {&forget, "DELETE FROM footprints WHERE rowid <= (SELECT MAX(rowid) FROM footprints) - ?"},  // what is put anew gets a new number
  }};
  for (const auto& [statement, text] : statements) {
    if (status = prepare(*statement, text); status != SQLITE_OK) return failed();
  }
  return Opened::yes;
}

}  // namespace

struct FootprintStore::State {
  explicit State(std::filesystem::path f) : file(std::move(f)) {}

  const std::filesystem::path file;
  std::mutex mutex;  ///< guards what follows
  std::unique_ptr<Tables> tables;  ///< none if the file could not be made anew
  int status = SQLITE_OK;          ///< of what failed when it was opened
  bool told = false;               ///< that nothing can be written

  Opened open();
  Opened open_anew();
  std::string why_not(Opened opened) const;
  int write(const std::vector<Entry>& entries);
};

Opened FootprintStore::State::open() {
  auto made = std::make_unique<Tables>();
  const Opened opened = made->open(file, status);
  if (opened == Opened::yes) tables = std::move(made);
  return opened;
}

/// Sets the file aside and begins another one.
Opened FootprintStore::State::open_anew() {
  tables.reset();  // lets go of the file
  const std::filesystem::path aside = file.string() + ".damaged";
  std::error_code failure;
  std::filesystem::rename(file, aside, failure);
  if (!failure) {
    for (const char* more : {"-wal", "-shm"}) std::filesystem::remove(file.string() + more, failure);
    log::warning(fmt::format("{}: no readable store of footprints; it was set aside as {} and begun anew", file.string(), aside.string()));
  }
  return open();
}

std::string FootprintStore::State::why_not(Opened opened) const {
  const int kind = status & 0xff;
  if (opened == Opened::newer) return fmt::format("{}: the store of footprints was made by a later version of the program; --disk-cache names another folder", file.string());
  if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED) return fmt::format("{}: the store of footprints is held by another program", file.string());
  return fmt::format("{}: the store of footprints cannot be opened: {}; is the folder there and writable, and is there room?", file.string(), sqlite3_errstr(status));
}

/// All or none.
int FootprintStore::State::write(const std::vector<Entry>& entries) {
  int written = tables->execute("BEGIN IMMEDIATE");
  if (written != SQLITE_OK) return written;
  for (const Entry& entry : entries) {
    if (entry.footprint.ring.size() > kMostPlaces) continue;
    const std::string bytes = bytes_of(entry.footprint);
    InUse put(tables->put);
    put.bind(1, entry.path);
    put.bind(2, entry.revision);
    put.bind_blob(3, bytes);
    put.bind(4, checksum_of(entry.path, entry.revision, bytes));
    if (written = put.step(); written != SQLITE_DONE) break;
  }
  if (written == SQLITE_DONE || written == SQLITE_OK) {
    InUse forget(tables->forget);
    forget.bind(1, kMostKept);
    written = forget.step();
  }
  if (written == SQLITE_DONE) written = tables->execute("COMMIT");
  if (written != SQLITE_OK) tables->execute("ROLLBACK");
  return written;
}

FootprintStore::FootprintStore(std::unique_ptr<State> state) : state_(std::move(state)) {}
FootprintStore::~FootprintStore() = default;

Result<std::unique_ptr<FootprintStore>> FootprintStore::open(const std::filesystem::path& file) {
  auto state = std::make_unique<State>(file);
  std::error_code failure;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failure);
  Opened opened = state->open();
  if (opened == Opened::foreign) opened = state->open_anew();
  if (opened != Opened::yes) return Error{ErrorCode::unavailable, state->why_not(opened)};
  return std::unique_ptr<FootprintStore>(new FootprintStore(std::move(state)));
}

std::optional<KeptFootprint> FootprintStore::find(const std::string& path, const std::string& revision) const {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  if (!s.tables) return std::nullopt;
  InUse find(s.tables->find);
  find.bind(1, path);
  find.bind(2, revision);
  if (find.step() != SQLITE_ROW) return std::nullopt;
  const std::string_view bytes = find.blob(0);
  if (find.number(1) != checksum_of(path, revision, bytes)) return std::nullopt;
  return footprint_of(bytes);
}

void FootprintStore::keep(const std::vector<Entry>& entries) {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  if (!s.tables || entries.empty()) return;
  int written = s.write(entries);
  if (is_damage(written) && s.open_anew() == Opened::yes) written = s.write(entries);
  if (written != SQLITE_OK && !std::exchange(s.told, true))
    log::warning(fmt::format("{}: {}; footprints that are found are not kept", s.file.string(), sqlite3_errstr(written)));
}

}  // namespace tellurion::source
