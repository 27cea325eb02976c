#include "source/temporal/time_steps.h"

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::source;

namespace {

TimeSteps steps_of(const TimeSpec& spec) {
  auto steps = TimeSteps::create(spec);
  REQUIRE_MESSAGE(steps, steps.error().message);
  return *steps;
}

std::string fault_of(const TimeSpec& spec) {
  const auto steps = TimeSteps::create(spec);
  REQUIRE_FALSE(steps);
  return steps.error().message;
}

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

UtcTime utc(const char* text) { return parse_utc(text).value(); }

TimeSpec range(const char* start, const char* end, const char* step, const char* format = "%Y-%m-%d") { return {format, {}, start, end, step}; }

}  // namespace

TEST_CASE("TimeSteps: days of a leap year") {
  const TimeSteps days = steps_of(range("2020-01-01", "2020-12-31", "P1D"));
  CHECK(days.count() == 366);
  CHECK(days.text(0) == "2020-01-01");
  CHECK(days.text(59) == "2020-02-29");
  CHECK(days.text(365) == "2020-12-31");
  CHECK(days.step_at(utc("2020-02-29T23:59:59Z")) == 59);
  CHECK(days.step_at(utc("2020-03-01T00:00:00Z")) == 60);
}

TEST_CASE("TimeSteps: outside of the range the nearest end is shown, without a time the last") {
  const TimeSteps days = steps_of(range("2020-01-01", "2020-01-31", "P8D"));
  CHECK(days.count() == 4);
  CHECK(days.text(days.step_at(utc("1900-01-01"))) == "2020-01-01");
  CHECK(days.text(days.step_at(utc("2100-01-01"))) == "2020-01-25");
  CHECK(days.text(days.step_at(std::nullopt)) == "2020-01-25");
}

TEST_CASE("TimeSteps: months keep their day as far as they have it, years are twelve months") {
  const TimeSteps months = steps_of(range("2019-01-31T12:00Z", "2020-03-31", "P1M", "%Y%m%d%H"));
  CHECK(months.text(1) == "2019022812");
  CHECK(months.text(13) == "2020022912");
  CHECK(months.count() == 14);  // noon of 31 March 2020 is after the end
  for (std::int64_t i = 0; i < months.count(); ++i) CHECK(months.step_at(months.time(i)) == i);
  const TimeSteps years = steps_of(range("1985-01-01", "2020-01-01", "P10Y", "%Y"));
  CHECK(years.count() == 4);
  CHECK(years.text(3) == "2015");
}

TEST_CASE("TimeSteps: hours, minutes and days of the year") {
  const TimeSteps hours = steps_of(range("2024-12-31T18:00Z", "2025-01-01T06:00Z", "PT6H", "%Y/%j/%H%M%S"));
  CHECK(hours.count() == 3);
  CHECK(hours.text(0) == "2024/366/180000");
  CHECK(hours.text(1) == "2025/001/000000");
}

TEST_CASE("TimeSteps: values") {
  const TimeSteps years = steps_of({"%Y", {"1985", "1995", "2005", "2015", "2020"}, "", "", ""});
  CHECK(years.count() == 5);
  CHECK(years.text(years.step_at(utc("2004-12-31"))) == "1995");
  CHECK(years.text(years.step_at(utc("2005-01-01"))) == "2005");
  CHECK(years.text(years.step_at(utc("1970-01-01"))) == "1985");
}

TEST_CASE("parse_time: what format_time writes comes back") {
  const UtcTime time = utc("2004-02-29T13:05:59Z");
  for (const char* format : {"%Y-%m-%dT%H:%M:%S", "%Y%j%H%M%S", "x%%%d.%m.%Y %H-%M-%S"}) {
    const auto again = parse_time(format_time(time, format), format);
    REQUIRE(again);
    CHECK(*again == time);
  }
  CHECK_FALSE(parse_time("2003-02-29", "%Y-%m-%d"));
  CHECK_FALSE(parse_time("2003-366", "%Y-%j"));
  CHECK_FALSE(parse_time("20031", "%Y"));
  CHECK_FALSE(parse_time("203", "%Y"));
  CHECK_FALSE(parse_time("2003-01-01T24", "%Y-%m-%dT%H"));
}

TEST_CASE("TimeSteps: what is wrong is named") {
  CHECK(contains(fault_of(range("2020-01-01", "2020-12-31", "P1D", "%Q")), "%Q"));
  CHECK(contains(fault_of(range("2020-01-01", "2020-12-31", "1D")), "\"1D\""));
  CHECK(contains(fault_of(range("2020-01-01", "2020-12-31", "P0D")), "\"P0D\""));
  CHECK(contains(fault_of(range("2020-01-01", "2020-12-31", "P1M1D")), "\"P1M1D\""));
  CHECK(contains(fault_of(range("2020-01-01", "2019-12-31", "P1D")), "before"));
  CHECK(contains(fault_of(range("2020-01-01", "never", "P1D")), "never"));
  CHECK(contains(fault_of(range("2020-01-01", "2020-12-31", "PT1S")), "at most"));
  CHECK(contains(fault_of(range("2020-01-01", "2020-12-31", "")), "`step`"));
  CHECK(contains(fault_of({"%Y", {}, "", "", ""}), "values"));
  CHECK(contains(fault_of({"%Y", {"1990"}, "1990-01-01", "", ""}), "values"));
  CHECK(contains(fault_of({"%Y", {"1990", "1985"}, "", "", ""}), "1985"));
  CHECK(contains(fault_of({"%Y", {"199O"}, "", "", ""}), "199O"));
}

TEST_CASE("with_time: every placeholder is replaced") {
  CHECK(with_time("a/{time}/b_{time}.png", "{time}1") == "a/{time}1/b_{time}1.png");
  CHECK(has_time("a{time}"));
  CHECK_FALSE(has_time("{z}/{x}"));
}
