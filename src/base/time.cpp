#include "base/time.h"

#include <fmt/format.h>

#include <cassert>
#include <optional>

namespace tellurion {
namespace {

/// Takes text from its front, piece by piece.
class Reader {
 public:
  explicit Reader(std::string_view text) : rest_(text) {}

  bool at_end() const { return rest_.empty(); }
  bool take(char wanted) {
    if (!rest_.starts_with(wanted)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  std::optional<int> digit() {
    if (rest_.empty() || rest_.front() < '0' || rest_.front() > '9') return std::nullopt;
    const int value = rest_.front() - '0';
    rest_.remove_prefix(1);
    return value;
  }
  std::optional<int> digits(int count) {
    int value = 0;
    for (int i = 0; i < count; ++i) {
      const std::optional<int> next = digit();
      if (!next) return std::nullopt;
      value = value * 10 + *next;
    }
    return value;
  }

 private:
  std::string_view rest_;
};

/// Two digits in [0, limit).
std::optional<int> take_below(Reader& reader, int limit) {
  const std::optional<int> value = reader.digits(2);
  return value && *value < limit ? value : std::nullopt;
}

}  // namespace

Result<UtcTime> parse_utc(std::string_view text) {
  using namespace std::chrono;
  const auto fail = [&](const char* why) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("time '{}': {} (wanted: ISO 8601, as in 2024-06-20T20:51:00Z)", text.substr(0, 80), why)};
  };
  Reader reader(text);
  const std::optional<int> y = reader.digits(4);
  if (!y || !reader.take('-')) return fail("no year");
  const std::optional<int> m = reader.digits(2);
  if (!m || !reader.take('-')) return fail("no month");
  const std::optional<int> d = reader.digits(2);
  if (!d) return fail("no day");
  const year_month_day date(year(*y), month(static_cast<unsigned>(*m)), day(static_cast<unsigned>(*d)));
  if (!date.ok()) return fail("no such date");
  UtcTime time = sys_days(date);
  if (reader.at_end()) return time;

  if (!reader.take('T') && !reader.take(' ')) return fail("no T after the date");
  const std::optional<int> hour = take_below(reader, 24);
  if (!hour || !reader.take(':')) return fail("no hour of 00 to 23");
  const std::optional<int> minute = take_below(reader, 60);
  if (!minute) return fail("no minute of 00 to 59");
  time += hours(*hour) + minutes(*minute);
  if (reader.take(':')) {
    const std::optional<int> second = take_below(reader, 60);
    if (!second) return fail("no second of 00 to 59");
    time += seconds(*second);
    if (reader.take('.')) {
      std::optional<int> digit = reader.digit();
      if (!digit) return fail("no digits after the point");
      for (int unit = 100; digit; unit /= 10, digit = reader.digit()) time += milliseconds(*digit * unit);
    }
  }
  if (!reader.take('Z')) {
    const int sign = reader.take('+') ? 1 : reader.take('-') ? -1 : 0;
    if (sign != 0) {
      const std::optional<int> offset_hour = take_below(reader, 24);
      const bool colon = reader.take(':');
      const std::optional<int> offset_minute = take_below(reader, 60);
      if (!offset_hour || !colon || !offset_minute) return fail("no zone of the form +hh:mm");
      time -= sign * (hours(*offset_hour) + minutes(*offset_minute));
    }
  }
  if (!reader.at_end()) return fail("something after its end");
  return time;
}

std::string format_utc(UtcTime time) {
  using namespace std::chrono;
  const sys_days midnight = floor<days>(time);
  const year_month_day date(midnight);
  assert(date.year() >= year(0) && date.year() <= year(9999));
  const hh_mm_ss clock(time - midnight);
  const std::string fraction = clock.subseconds().count() == 0 ? "" : fmt::format(".{:03}", clock.subseconds().count());
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}{}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), clock.hours().count(),
                     clock.minutes().count(), clock.seconds().count(), fraction);
}

}  // namespace tellurion
