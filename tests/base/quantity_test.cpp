#include "base/quantity.h"

#include <doctest/doctest.h>

#include <numbers>

using namespace tellurion;

TEST_CASE("to_radians: half a turn is pi") { CHECK(to_radians(180.0_deg).value == std::numbers::pi); }

TEST_CASE("to_degrees: a right angle comes back") {
  CHECK(to_degrees(to_radians(Degrees(90.0))).value == doctest::Approx(90.0).epsilon(1e-15));
}

TEST_CASE("Quantity: adds, scales and compares like its number") {
  Metres length = 3_m + 4.5_m;
  length -= Metres(0.5);
  length += Metres(1.0);
  CHECK(length == Metres(8.0));
  CHECK(2.0 * length / 4.0 == Metres(4.0));
  CHECK(-length < Metres(0.0));
  CHECK(length / Metres(2.0) == 4.0);
}

TEST_CASE("Quantity: is as small as its number") { CHECK(sizeof(Metres) == sizeof(double)); }
