#include "base/hash.h"

#include <doctest/doctest.h>

using tellurion::fnv1a;

// The values are those of the algorithm's own list of test vectors.
TEST_CASE("fnv1a: known values") {
  CHECK(fnv1a("") == 0xcbf29ce484222325ull);
  CHECK(fnv1a("a") == 0xaf63dc4c8601ec8cull);
  CHECK(fnv1a("foobar") == 0x85944171f73967e8ull);
}
