#include "base/result.h"

#include <doctest/doctest.h>

#include <memory>
#include <string>

using namespace tellurion;

TEST_CASE("Result: holds a value or an error, never both") {
  const Result<int> right = 3;
  const Result<int> wrong(ErrorCode::corrupt, "bad header");
  CHECK(right);
  CHECK(*right == 3);
  CHECK_FALSE(wrong);
  CHECK(wrong.error().code == ErrorCode::corrupt);
  CHECK(wrong.error().message == "bad header");
}

TEST_CASE("Result: a value that cannot be copied can be moved out") {
  Result<std::unique_ptr<int>> owner = std::make_unique<int>(7);
  const std::unique_ptr<int> taken = *std::move(owner);
  CHECK(*taken == 7);
}

TEST_CASE("Result: value_or gives the fallback for an error only") {
  CHECK(Result<std::string>("there").value_or("fallback") == "there");
  CHECK(Result<std::string>(ErrorCode::not_found, "gone").value_or("fallback") == "fallback");
}

TEST_CASE("Result<void>: succeeds by default") {
  CHECK(Result<void>());
  const Result<void> wrong = Error{ErrorCode::unavailable, "try later"};
  CHECK_FALSE(wrong);
  CHECK(wrong.error().message == "try later");
}

TEST_CASE("name_of: names every code differently") {
  CHECK(std::string(name_of(ErrorCode::invalid_argument)) == "invalid argument");
  CHECK(std::string(name_of(ErrorCode::exhausted)) == "exhausted");
}
