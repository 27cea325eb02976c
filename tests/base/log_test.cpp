#include "base/log.h"

#include <doctest/doctest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>

using namespace tellurion;

namespace {

/// What `action` writes to standard error.
template <class Action>
std::string standard_error_of(Action action) {
  std::array<int, 2> ends{};
  REQUIRE(pipe(ends.data()) == 0);
  std::fflush(stderr);
  const int kept = dup(STDERR_FILENO);
  dup2(ends[1], STDERR_FILENO);
  action();
  std::fflush(stderr);
  dup2(kept, STDERR_FILENO);
  close(kept);
  close(ends[1]);
  std::string text;
  std::array<char, 256> buffer{};
  for (ssize_t count; (count = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  close(ends[0]);
  return text;
}

}  // namespace

TEST_CASE("log: writes one line with its severity to standard error") {
  CHECK(standard_error_of([] { log::info("12 tiles {}"); }) == "12 tiles {}\n");
  CHECK(standard_error_of([] { log::warning("no vertical datum"); }) == "warning: no vertical datum\n");
  CHECK(standard_error_of([] { log::error("gone"); }) == "error: gone\n");
}

TEST_CASE("log: drops what is below the threshold") {
  CHECK(standard_error_of([] { log::debug("detail"); }).empty());
  log::set_threshold(log::Severity::error);
  CHECK(standard_error_of([] { log::warning("drop me"); }).empty());
  log::set_threshold(log::Severity::debug);
  CHECK(standard_error_of([] { log::debug("detail"); }) == "debug: detail\n");
  log::set_threshold(log::Severity::info);
}
