// Somebody's SQLite database, for reading only: whatever is in it, queries end, and nothing is written beside it.
// Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"

namespace tellurion::source {

/// A value of a column: NULL, a number, or text or a blob.
using SqlValue = std::variant<std::monostate, std::int64_t, double, std::string>;
using SqlRow = std::vector<SqlValue>;

class SqliteArchive {
 public:
  /// Errors, naming the file: not_found; corrupt (no database); unavailable (another program is writing it).
  static Result<std::unique_ptr<SqliteArchive>> open(const std::filesystem::path& file);
  ~SqliteArchive();
  SqliteArchive(const SqliteArchive&) = delete;
  SqliteArchive& operator=(const SqliteArchive&) = delete;

  /// The first `most_rows` rows of a query whose `?` stand for `values`; texts in UTF-8.
  /// Errors, naming the file: corrupt; unsupported (no such table or column); exhausted (takes seconds, or the rows hold more than 32 MB).
  Result<std::vector<SqlRow>> rows(const std::string& query, std::initializer_list<SqlValue> values, std::size_t most_rows) const;
  bool has_table(const std::string& name) const;  ///< or view

  const std::string& name() const;
  std::string revision() const;  ///< another one when the file is another

 private:
  struct State;
  explicit SqliteArchive(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Readings of a value; `fallback` if it is none of them. Text of digits counts as a number, as SQLite's columns hold anything.
std::int64_t whole_of(const SqlValue& value, std::int64_t fallback);
double number_of(const SqlValue& value, double fallback);
std::string text_of(const SqlValue& value);

/// `name` as an identifier in a query.
std::string sql_name(const std::string& name);

}  // namespace tellurion::source
