#include "base/frozen.h"

#include <doctest/doctest.h>

#include <type_traits>
#include <vector>

using namespace tellurion;

TEST_CASE("Frozen: shares one value and keeps it alive") {
  Frozen<std::vector<int>> first = freeze(std::vector<int>{1, 2, 3});
  const Frozen<std::vector<int>> second = first;
  CHECK(first.get() == second.get());
  first = {};
  CHECK_FALSE(first);
  CHECK(second->size() == 3);
}

TEST_CASE("Frozen: gives no way to change the value") {
  CHECK(std::is_same_v<decltype(*Frozen<int>()), const int&>);
  CHECK(std::is_same_v<decltype(Frozen<int>().get()), const int*>);
}
