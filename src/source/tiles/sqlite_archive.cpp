#include "source/tiles/sqlite_archive.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

namespace tellurion::source {
namespace {

constexpr int kMostValueBytes = 16 << 20;   ///< of a text or blob
constexpr std::size_t kMostAnswerBytes = std::size_t{2} * kMostValueBytes;  ///< of all texts and blobs that a query gives
constexpr std::size_t kMostStatements = 16; ///< kept prepared
constexpr int kStepsBetween = 1'000;        ///< of SQLite's machine, between two looks at the clock
constexpr std::chrono::seconds kLongestQuery{3};

struct DatabaseDeleter {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct StatementDeleter {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, StatementDeleter>;

/// The file as a URI of SQLite, which then neither locks it nor looks for journals.
std::string immutable_uri(const std::filesystem::path& file) {
  std::error_code failure;
  const std::string path = std::filesystem::absolute(file, failure).string();
  std::string uri = "file:";
  for (const char c : path) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' || c == '.' || c == '-' || c == '_';
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri + "?immutable=1";
}

/// Whether changes wait beside the file that are not in it yet: a write-ahead log, or a rollback journal that was not undone.
bool is_being_written(const std::filesystem::path& file) {
  std::error_code failure;
  const auto size_of = [&](const char* more) {
    const auto size = std::filesystem::file_size(file.string() + more, failure);
    return failure ? std::uintmax_t{0} : size;
  };
  if (size_of("-wal") > 0) return true;
  if (size_of("-journal") == 0) return false;
  char first = 0;  // of the journal's magic number; zero once it has been dealt with
  std::ifstream(file.string() + "-journal", std::ios::binary).get(first);
  return first != 0;
}

/// What queries and the views of the file may do: read tables, without recursion and without functions that make large values.
int may_do(void*, int action, const char*, const char* function, const char*, const char*) {
  constexpr std::string_view kFunctions[] = {"min", "max", "count", "coalesce", "ifnull", "nullif", "iif", "abs", "round", "length", "substr", "lower", "upper", "like"};
  if (action == SQLITE_SELECT || action == SQLITE_READ) return SQLITE_OK;
  if (action != SQLITE_FUNCTION || function == nullptr) return SQLITE_DENY;
  return std::find(std::begin(kFunctions), std::end(kFunctions), std::string_view(function)) != std::end(kFunctions) ? SQLITE_OK : SQLITE_DENY;
}

SqlValue value_at(sqlite3_stmt* statement, int column) {
  switch (sqlite3_column_type(statement, column)) {
    case SQLITE_INTEGER: return std::int64_t{sqlite3_column_int64(statement, column)};
    case SQLITE_FLOAT: return sqlite3_column_double(statement, column);
    case SQLITE_NULL: return std::monostate{};
    default: break;
  }
  // Text comes as UTF-8, whatever the database's own encoding.
  const bool is_text = sqlite3_column_type(statement, column) == SQLITE_TEXT;
  const void* data = is_text ? sqlite3_column_text(statement, column) : sqlite3_column_blob(statement, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
  return data != nullptr ? std::string(static_cast<const char*>(data), size) : std::string();
}

void bind(sqlite3_stmt* statement, int place, const SqlValue& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) sqlite3_bind_int64(statement, place, *number);
  else if (const auto* real = std::get_if<double>(&value)) sqlite3_bind_double(statement, place, *real);
  else if (const auto* text = std::get_if<std::string>(&value)) sqlite3_bind_text64(statement, place, text->data(), text->size(), SQLITE_TRANSIENT, SQLITE_UTF8);
}

}  // namespace

struct SqliteArchive::State {
  std::string name;
  std::string revision;
  std::mutex mutex;  ///< guards what follows
  std::unique_ptr<sqlite3, DatabaseDeleter> database;
  std::map<std::string, Statement> statements;  ///< by their text
  std::chrono::steady_clock::time_point deadline;  ///< of the query that runs

  Error error(int status) const;
  sqlite3_stmt* prepared(const std::string& query, int& status);
};

Error SqliteArchive::State::error(int status) const {
  switch (status & 0xff) {
    case SQLITE_NOTADB: return {ErrorCode::corrupt, fmt::format("{}: is no SQLite database", name)};
    case SQLITE_CORRUPT: return {ErrorCode::corrupt, fmt::format("{}: the database is damaged or cut off", name)};
    case SQLITE_INTERRUPT:
      return {ErrorCode::exhausted, fmt::format("{}: takes too long to find something; has its table of tiles an index by zoom, column and row?", name)};
    case SQLITE_NOMEM:
    case SQLITE_TOOBIG: return {ErrorCode::exhausted, fmt::format("{}: holds a value that is too large", name)};
    case SQLITE_ERROR:
    case SQLITE_AUTH: return {ErrorCode::unsupported, fmt::format("{}: is not built as it should be: {}", name, sqlite3_errmsg(database.get()))};
    case SQLITE_CANTOPEN:
    case SQLITE_PERM: return {ErrorCode::unavailable, fmt::format("{}: cannot be opened; may it be read?", name)};
    default: return {ErrorCode::corrupt, fmt::format("{}: cannot be read: {}", name, sqlite3_errstr(status))};
  }
}

sqlite3_stmt* SqliteArchive::State::prepared(const std::string& query, int& status) {
  if (const auto found = statements.find(query); found != statements.end()) return found->second.get();
  sqlite3_stmt* made = nullptr;
  status = sqlite3_prepare_v3(database.get(), query.c_str(), -1, SQLITE_PREPARE_PERSISTENT, &made, nullptr);
  Statement statement(made);
  if (status != SQLITE_OK) return nullptr;
  if (statements.size() == kMostStatements) statements.erase(statements.begin());
  return statements.emplace(query, std::move(statement)).first->second.get();
}

SqliteArchive::SqliteArchive(std::unique_ptr<State> state) : state_(std::move(state)) {}
SqliteArchive::~SqliteArchive() = default;

Result<std::unique_ptr<SqliteArchive>> SqliteArchive::open(const std::filesystem::path& file) {
  auto state = std::make_unique<State>();
  state->name = file.string();
  std::error_code failure;
  if (!std::filesystem::exists(file, failure)) return Error{ErrorCode::not_found, fmt::format("{}: no such file", state->name)};
  if (!std::filesystem::is_regular_file(file, failure)) return Error{ErrorCode::unsupported, fmt::format("{}: is no file", state->name)};
  if (is_being_written(file)) {
    return Error{ErrorCode::unavailable, fmt::format("{}: has changes that are not in it yet (beside it lies a -wal or -journal file); close the program that writes "
                                                     "it, or run: sqlite3 FILE 'PRAGMA wal_checkpoint(TRUNCATE)'", state->name)};
  }
  state->revision = fmt::format("{}|{} {}", state->name, std::filesystem::file_size(file, failure),
                                std::filesystem::last_write_time(file, failure).time_since_epoch().count());
  sqlite3* opened = nullptr;
  const int status = sqlite3_open_v2(immutable_uri(file).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  state->database.reset(opened);
  if (status != SQLITE_OK) return state->error(status);
  sqlite3* database = state->database.get();
  sqlite3_extended_result_codes(database, 1);
  for (const auto& [what, on] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1}, {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0}, {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                 {SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0}})
    sqlite3_db_config(database, what, on, nullptr);
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, kMostValueBytes);
  sqlite3_limit(database, SQLITE_LIMIT_SQL_LENGTH, 100'000);
  sqlite3_limit(database, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_limit(database, SQLITE_LIMIT_EXPR_DEPTH, 50);
  sqlite3_limit(database, SQLITE_LIMIT_COMPOUND_SELECT, 20);
  sqlite3_limit(database, SQLITE_LIMIT_LIKE_PATTERN_LENGTH, 50);
  sqlite3_progress_handler(database, kStepsBetween, [](void* s) { return std::chrono::steady_clock::now() > static_cast<State*>(s)->deadline ? 1 : 0; }, state.get());
  sqlite3_exec(database, "PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0", nullptr, nullptr, nullptr);
  sqlite3_set_authorizer(database, may_do, nullptr);
  std::unique_ptr<SqliteArchive> archive(new SqliteArchive(std::move(state)));
  if (const auto schema = archive->rows("SELECT name FROM sqlite_schema LIMIT 1", {}, 1); !schema) return schema.error();
  return archive;
}

Result<std::vector<SqlRow>> SqliteArchive::rows(const std::string& query, std::initializer_list<SqlValue> values, std::size_t most_rows) const {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  s.deadline = std::chrono::steady_clock::now() + kLongestQuery;
  int status = SQLITE_OK;
  sqlite3_stmt* statement = s.prepared(query, status);
  if (statement == nullptr) return s.error(status);
  int place = 0;
  for (const SqlValue& value : values) bind(statement, ++place, value);
  std::vector<SqlRow> found;
  std::size_t bytes = 0;
  while (bytes <= kMostAnswerBytes && found.size() < most_rows && (status = sqlite3_step(statement)) == SQLITE_ROW) {
    SqlRow row;
    for (int column = 0; column < sqlite3_column_count(statement) && bytes <= kMostAnswerBytes; ++column) {
      row.push_back(value_at(statement, column));
      if (const auto* text = std::get_if<std::string>(&row.back())) bytes += text->size();
    }
    found.push_back(std::move(row));
  }
  const bool good = status == SQLITE_ROW || status == SQLITE_DONE || status == SQLITE_OK;
  std::optional<Error> error;
  if (!good) error = s.error(status);
  if (bytes > kMostAnswerBytes)
    error = Error{ErrorCode::exhausted, fmt::format("{}: has rows of more than {} MB together where a few lines should be", s.name, kMostAnswerBytes >> 20)};
  sqlite3_reset(statement);
  sqlite3_clear_bindings(statement);
  if (error) return std::move(*error);
  return found;
}

bool SqliteArchive::has_table(const std::string& name) const {
  const auto found = rows("SELECT 1 FROM sqlite_schema WHERE name = ? COLLATE NOCASE AND type IN ('table', 'view')", {name}, 1);
  return found && !found->empty();
}

const std::string& SqliteArchive::name() const { return state_->name; }
std::string SqliteArchive::revision() const { return state_->revision; }

double number_of(const SqlValue& value, double fallback) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* real = std::get_if<double>(&value)) return std::isfinite(*real) ? *real : fallback;
  if (const auto* text = std::get_if<std::string>(&value)) {
    double number = 0;
    const auto [end, failure] = std::from_chars(text->data(), text->data() + text->size(), number);
    if (failure == std::errc() && end == text->data() + text->size() && std::isfinite(number)) return number;
  }
  return fallback;
}

std::int64_t whole_of(const SqlValue& value, std::int64_t fallback) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole;
  const double number = number_of(value, std::numeric_limits<double>::quiet_NaN());
  return std::abs(number) <= 9e15 && number == std::floor(number) ? static_cast<std::int64_t>(number) : fallback;
}

std::string text_of(const SqlValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  return text ? *text : std::string();
}

std::string sql_name(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + "\"";
}

}  // namespace tellurion::source
