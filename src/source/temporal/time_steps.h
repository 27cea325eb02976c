// The moments of which a source has data, and how they are written in its paths and URLs.
// Thread-safe: immutable values.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace tellurion::source {

/// What a world file says of a source's times: either `values`, or `start`, `end` and `step`.
struct TimeSpec {
  std::string format = "%Y-%m-%d";  ///< of {time}: %Y %m %d %H %M %S %j (day of the year) %%
  std::vector<std::string> values;  ///< in `format`
  std::string start;                ///< ISO 8601
  std::string end;                  ///< the last step is not after it
  std::string step;                 ///< an ISO 8601 duration: "P1D", "PT6H", "P1M"
};

/// `time` in the format of a TimeSpec.
std::string format_time(UtcTime time, std::string_view format);
/// The reverse; fields that the format lacks are the first: of year 1970, January, day 1, midnight.
/// Errors: invalid_argument (the text has another form, an unknown field, no such day).
Result<UtcTime> parse_time(std::string_view text, std::string_view format);

class TimeSteps {
 public:
  static constexpr std::int64_t kMost = 1'000'000;

  /// Errors: invalid_argument, naming what is wrong.
  static Result<TimeSteps> create(const TimeSpec& spec);

  std::int64_t count() const { return values_.empty() ? count_ : static_cast<std::int64_t>(values_.size()); }
  /// Requires 0 <= step < count (asserted). Ascending.
  UtcTime time(std::int64_t step) const;
  /// What stands for {time}.
  std::string text(std::int64_t step) const { return format_time(time(step), format_); }
  /// The latest step not after `moment`; the first if all are. Without a moment the last.
  std::int64_t step_at(const std::optional<UtcTime>& moment) const;

 private:
  TimeSteps() = default;
  Result<void> set_values(const TimeSpec& spec);
  Result<void> set_range(const TimeSpec& spec);

  std::string format_;
  std::vector<UtcTime> values_;
  UtcTime start_{};
  std::int64_t count_ = 0;
  int months_ = 0;                          ///< of a step; 0: it is a fixed time
  std::chrono::milliseconds duration_{0};
};

/// `text` with every "{time}" replaced.
std::string with_time(std::string text, std::string_view time);
bool has_time(std::string_view text);

}  // namespace tellurion::source
