#include "source/length_unit.h"

#include <doctest/doctest.h>

using tellurion::source::metres_of_unit;

TEST_CASE("metres_of_unit: lengths in any case, and what is none") {
  CHECK(metres_of_unit("Metre") == 1.0);
  CHECK(metres_of_unit("KM") == 1000.0);
  CHECK(metres_of_unit("ft") == 0.3048);
  CHECK(metres_of_unit("US survey foot") == 1200.0 / 3937.0);
  CHECK(metres_of_unit("[ft_us]") == 1200.0 / 3937.0);
  CHECK_FALSE(metres_of_unit(""));
  CHECK_FALSE(metres_of_unit("metr"));
  CHECK_FALSE(metres_of_unit("degree"));
}
