#include "base/number.h"

#include <doctest/doctest.h>

#include <string>

using namespace tellurion;

TEST_CASE("parse_number: reads decimal notation") {
  CHECK(parse_number("0") == 0.0);
  CHECK(parse_number("-12.5") == -12.5);
  CHECK(parse_number("+3") == 3.0);
  CHECK(parse_number(" 1e3\t") == 1000.0);
  CHECK(parse_number(".5") == 0.5);
  CHECK(parse_number("0.1") == 0.1);
}

TEST_CASE("parse_number: refuses everything else") {
  for (const std::string text : {"",     " ",     "+",    "-",   "abc", "1x",  "1 2", "1,5", "nan",  "inf",
                                 "-inf", "1e999", "0x10", "--1", "+-1", "-+1", "1e",  "e5",  "1..2", "+ 1"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_number(text));
  }
}
