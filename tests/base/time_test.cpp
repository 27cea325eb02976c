#include "base/time.h"

#include <doctest/doctest.h>

#include <ctime>
#include <random>
#include <string>

using namespace tellurion;
using namespace std::chrono;

namespace {

/// By the C library, as the independent source.
std::string format_by_c(UtcTime time) {
  const std::time_t seconds_since_1970 = floor<seconds>(time).time_since_epoch().count();
  std::tm parts{};
  gmtime_r(&seconds_since_1970, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

}  // namespace

TEST_CASE("parse_utc: knows the epoch and a leap day") {
  CHECK(parse_utc("1970-01-01T00:00:00Z").value() == UtcTime());
  CHECK(parse_utc("2024-02-29").value().time_since_epoch() == seconds(1709164800));  // date -u -d 2024-02-29 +%s
  CHECK(parse_utc("1969-12-31T23:59:59.999Z").value().time_since_epoch() == milliseconds(-1));
}

TEST_CASE("parse_utc: accepts short forms, fractions and zones") {
  const UtcTime expected = parse_utc("2024-06-20T20:51:00Z").value();
  CHECK(parse_utc("2024-06-20T20:51Z").value() == expected);
  CHECK(parse_utc("2024-06-20 20:51").value() == expected);
  CHECK(parse_utc("2024-06-20T22:51+02:00").value() == expected);
  CHECK(parse_utc("2024-06-20T15:21:00-05:30").value() == expected);
  CHECK(parse_utc("2024-06-20T20:51:00.25Z").value() == expected + milliseconds(250));
  CHECK(parse_utc("2024-06-20T20:51:00.1239999Z").value() == expected + milliseconds(123));
}

TEST_CASE("parse_utc: names the text and its fault") {
  for (const std::string text :
       {"", "2024", "2024-6-20", "2023-02-29", "2024-13-01", "2024-00-10", "2024-06-20T24:00Z", "2024-06-20T20:60Z",
        "2024-06-20T20:51:60Z", "2024-06-20T20:51:00.Z", "2024-06-20T20:51:00+2", "2024-06-20T20:51:00Zz", "24-06-20",
        "2024-06-20T", "2024-06-20x", "yesterday", "2024-06-20T20:51:00+02:00Z", "-024-06-20"}) {
    CAPTURE(text);
    const Result<UtcTime> result = parse_utc(text);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::invalid_argument);
    CHECK(result.error().message.find("'" + text + "'") != std::string::npos);
  }
}

TEST_CASE("format_utc: agrees with the C library and reads back") {
  const unsigned seed = 20240620;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::int64_t> any(-62167219200, 253402300799);  // years 0 to 9999
  for (int i = 0; i < 2000; ++i) {
    const UtcTime time{seconds(any(random))};
    const std::string text = format_utc(time);
    if (time >= sys_days(year(1000) / 1 / 1)) CHECK(text == format_by_c(time));
    CHECK(parse_utc(text).value() == time);
    CHECK(parse_utc(format_utc(time + milliseconds(7))).value() == time + milliseconds(7));
  }
}
