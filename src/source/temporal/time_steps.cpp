#include "source/temporal/time_steps.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace tellurion::source {
namespace {

using namespace std::chrono;

constexpr std::string_view kPlaceholder = "{time}";
constexpr std::size_t kLongestFormat = 200;

Error invalid(std::string message) { return {ErrorCode::invalid_argument, std::move(message)}; }

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// How many digits a field has; 0: no such field.
int digits_of(char field) {
  switch (field) {
    case 'Y': return 4;
    case 'j': return 3;
    case 'm':
    case 'd':
    case 'H':
    case 'M':
    case 'S': return 2;
    default: return 0;
  }
}

Result<void> check_format(const std::string& format) {
  if (format.empty() || format.size() > kLongestFormat) return invalid(fmt::format("`format` has 1 to {} letters", kLongestFormat));
  for (std::size_t i = 0; i < format.size(); ++i) {
    if (format[i] != '%') continue;
    const char field = ++i < format.size() ? format[i] : ' ';
    if (field != '%' && digits_of(field) == 0)
      return invalid(fmt::format("%{} means nothing in a `format` of times: it knows %Y, %m, %d, %H, %M, %S, %j and %%", field));
  }
  return {};
}

/// A length of time: months, or milliseconds.
struct Duration {
  std::int64_t months = 0;
  milliseconds fixed{0};
};

/// Reads "P1Y2M", "P8D", "PT6H30M": whole numbers; years and months do not mix with the rest.
Result<Duration> parse_duration(const std::string& text) {
  const auto fault = [&] {
    return invalid(fmt::format("step = \"{}\" is no length of time: an ISO 8601 duration as \"P1D\", \"P8D\", \"PT6H\", \"P1M\" or \"P1Y\", years and months by themselves", text));
  };
  Duration sum;
  if (text.size() < 3 || text.size() > 40 || text[0] != 'P') return fault();
  bool in_day = false;
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == 'T') {
      if (in_day) return fault();
      in_day = true;
      continue;
    }
    std::int64_t number = 0;
    const std::size_t first = i;
    for (; i < text.size() && is_digit(text[i]) && number < 100'000'000; ++i) number = 10 * number + (text[i] - '0');
    if (i == first || i == text.size()) return fault();
    const char unit = text[i];
    if (!in_day && unit == 'Y') sum.months += 12 * number;
    else if (!in_day && unit == 'M') sum.months += number;
    else if (!in_day && unit == 'W') sum.fixed += hours(24 * 7 * number);
    else if (!in_day && unit == 'D') sum.fixed += hours(24 * number);
    else if (in_day && unit == 'H') sum.fixed += hours(number);
    else if (in_day && unit == 'M') sum.fixed += minutes(number);
    else if (in_day && unit == 'S') sum.fixed += seconds(number);
    else return fault();
  }
  const bool one_of_both = (sum.months > 0) != (sum.fixed > milliseconds(0));
  constexpr std::int64_t kLongest = 12 * 10'000;
  if (!one_of_both || sum.months > kLongest) return fault();
  return sum;
}

/// A day that the month lacks becomes its last.
UtcTime add_months(UtcTime start, std::int64_t count) {
  const sys_days day = floor<days>(start);
  const year_month_day date(day);
  const year_month month = date.year() / date.month() + months(static_cast<int>(count));
  const year_month_day_last last = month / std::chrono::last;
  const year_month_day shifted = month / std::min(date.day(), last.day());
  return sys_days(shifted) + (start - day);
}

std::int64_t months_of(UtcTime time) {
  const year_month_day date(floor<days>(time));
  return 12 * static_cast<std::int64_t>(static_cast<int>(date.year())) + static_cast<unsigned>(date.month());
}

}  // namespace

std::string format_time(UtcTime time, std::string_view format) {
  const sys_days day = floor<days>(time);
  const year_month_day date(day);
  const hh_mm_ss<milliseconds> clock(time - day);
  const auto day_of_year = (day - sys_days(date.year() / January / 1)).count() + 1;
  std::string text;
  for (std::size_t i = 0; i < format.size(); ++i) {
    if (format[i] != '%' || i + 1 == format.size()) {
      text += format[i];
      continue;
    }
    switch (format[++i]) {
      case 'Y': text += fmt::format("{:04}", static_cast<int>(date.year())); break;
      case 'm': text += fmt::format("{:02}", static_cast<unsigned>(date.month())); break;
      case 'd': text += fmt::format("{:02}", static_cast<unsigned>(date.day())); break;
      case 'H': text += fmt::format("{:02}", clock.hours().count()); break;
      case 'M': text += fmt::format("{:02}", clock.minutes().count()); break;
      case 'S': text += fmt::format("{:02}", clock.seconds().count()); break;
      case 'j': text += fmt::format("{:03}", day_of_year); break;
      default: text += format[i];
    }
  }
  return text;
}

Result<UtcTime> parse_time(std::string_view text, std::string_view format) {
  const auto fault = [&] { return invalid(fmt::format("\"{}\" is no time written as `format` = \"{}\" says", text, format)); };
  int year = 1970, month = 1, of_month = 1, of_year = 0, hour = 0, minute = 0, second = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < format.size(); ++i) {
    const char field = format[i] == '%' && i + 1 < format.size() ? format[++i] : '\0';
    const int digits = digits_of(field);
    if (digits == 0) {
      if (at >= text.size() || text[at++] != format[i]) return fault();
      continue;
    }
    int number = 0;
    for (int k = 0; k < digits; ++k, ++at) {
      if (at >= text.size() || !is_digit(text[at])) return fault();
      number = 10 * number + (text[at] - '0');
    }
    switch (field) {
      case 'Y': year = number; break;
      case 'm': month = number; break;
      case 'd': of_month = number; break;
      case 'H': hour = number; break;
      case 'M': minute = number; break;
      case 'S': second = number; break;
      default: of_year = number;
    }
  }
  const year_month_day date = std::chrono::year(year) / month / of_month;
  const bool leap = std::chrono::year(year).is_leap();
  if (at != text.size() || !date.ok() || of_year > (leap ? 366 : 365) || hour > 23 || minute > 59 || second > 59) return fault();
  sys_days day(date);
  if (of_year > 0) day = sys_days(std::chrono::year(year) / January / 1) + days(of_year - 1);
  return UtcTime(day + hours(hour) + minutes(minute) + seconds(second));
}

Result<TimeSteps> TimeSteps::create(const TimeSpec& spec) {
  if (const auto checked = check_format(spec.format); !checked) return checked.error();
  TimeSteps steps;
  steps.format_ = spec.format;
  const bool has_range = !spec.start.empty() || !spec.end.empty() || !spec.step.empty();
  if (spec.values.empty() == !has_range)
    return invalid("the times are either values = [\"...\", ...] or start = \"...\", end = \"...\" and step = \"...\"");
  const Result<void> set = has_range ? steps.set_range(spec) : steps.set_values(spec);
  if (!set) return set.error();
  return steps;
}

Result<void> TimeSteps::set_values(const TimeSpec& spec) {
  if (spec.values.size() > static_cast<std::size_t>(kMost)) return invalid(fmt::format("a source has at most {} times", kMost));
  for (const std::string& value : spec.values) {
    const Result<UtcTime> time = parse_time(value, spec.format);
    if (!time) return time.error();
    if (!values_.empty() && *time <= values_.back()) return invalid(fmt::format("\"{}\" is not later than the value before it", value));
    values_.push_back(*time);
  }
  return {};
}

Result<void> TimeSteps::set_range(const TimeSpec& spec) {
  if (spec.start.empty() || spec.end.empty() || spec.step.empty())
    return invalid("the times need `start`, `end` and `step`, for example start = \"2020-01-01\", end = \"2020-12-31\", step = \"P1D\"");
  const Result<UtcTime> start = parse_utc(spec.start), end = parse_utc(spec.end);
  if (!start) return start.error();
  if (!end) return end.error();
  if (*end < *start) return invalid(fmt::format("end = \"{}\" is before start = \"{}\"", spec.end, spec.start));
  const Result<Duration> step = parse_duration(spec.step);
  if (!step) return step.error();
  start_ = *start;
  months_ = static_cast<int>(step->months);
  duration_ = step->fixed;
  if (months_ > 0) {
    count_ = (months_of(*end) - months_of(start_)) / months_ + 1;
    if (count_ > 1 && time(count_ - 1) > *end) --count_;
  } else {
    count_ = (*end - start_) / duration_ + 1;
  }
  if (count_ > kMost) return invalid(fmt::format("step = \"{}\" makes {} times of it: at most {} are possible", spec.step, count_, kMost));
  return {};
}

UtcTime TimeSteps::time(std::int64_t step) const {
  if (!values_.empty()) return values_[static_cast<std::size_t>(step)];
  assert(step >= 0 && step < count_);
  return months_ > 0 ? add_months(start_, step * months_) : start_ + step * duration_;
}

std::int64_t TimeSteps::step_at(const std::optional<UtcTime>& moment) const {
  const std::int64_t last = count() - 1;
  if (!moment || *moment >= time(last)) return last;
  if (*moment <= time(0)) return 0;
  std::int64_t low = 0, high = last;  // time(low) <= moment < time(high)
  while (high - low > 1) {
    const std::int64_t middle = low + (high - low) / 2;
    (time(middle) <= *moment ? low : high) = middle;
  }
  return low;
}

bool has_time(std::string_view text) { return text.find(kPlaceholder) != std::string_view::npos; }

std::string with_time(std::string text, std::string_view time) {
  for (std::size_t at = text.find(kPlaceholder); at != std::string::npos; at = text.find(kPlaceholder, at + time.size()))
    text.replace(at, kPlaceholder.size(), time);
  return text;
}

}  // namespace tellurion::source
