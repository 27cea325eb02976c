#include "globe/patience.h"

#include <doctest/doctest.h>

using namespace tellurion::globe;
using namespace std::chrono_literals;

TEST_CASE("Patience ends with failures alone, sixteen seconds after the last that came") {
  const Patience::TimePoint start{1h};
  Patience patience;
  patience.progressed(start);
  CHECK_FALSE(patience.is_over(start + 1h));  // slow is no failure
  patience.failed();
  CHECK_FALSE(patience.is_over(start + 16s));
  CHECK(patience.is_over(start + 17s));

  patience.received(100, start + 17s);
  CHECK_FALSE(patience.is_over(start + 1h));
  patience.failed();
  patience.received(100, start + 30s);  // the same bytes
  CHECK(patience.is_over(start + 34s));
  patience.received(101, start + 35s);
  CHECK_FALSE(patience.is_over(start + 1h));
}
