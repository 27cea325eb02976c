#include "fetch/fetch_now.h"

#include <string>

#include <doctest/doctest.h>

#include "fetch/little_server.h"

using namespace tellurion;
using namespace tellurion::fetch;
using tellurion::test::Ask;
using tellurion::test::LittleServer;
using tellurion::test::Say;
using namespace std::chrono_literals;

namespace {

StoreOptions quick() {
  StoreOptions options;
  options.fetch.first_pause = 10ms;
  return options;
}

}  // namespace

TEST_CASE("fetch_now: waits for the file, and has it at once the second time") {
  const LittleServer server([](const Ask& ask) { return Say{.body = "this is " + ask.path, .after = 50ms}; });
  ByteStore store(quick());
  for (int i = 0; i < 2; ++i) {
    const auto text = fetch_now(store, {server.url("/a"), {}, "a", {}}, 10s);
    REQUIRE(text);
    CHECK(*text == "this is /a");
  }
  CHECK(server.asked("/a") == 1);
}

TEST_CASE("fetch_now: what is not there, refused or too late is said, without credentials") {
  const LittleServer server([](const Ask& ask) {
    if (ask.path.starts_with("/slow")) return Say{.body = "late", .after = 2s};
    return Say{.status = ask.path.starts_with("/none") ? 404 : 403};
  });
  ByteStore store(quick());
  const auto asked = [&](const std::string& path, std::chrono::milliseconds patience) {
    const auto text = fetch_now(store, {server.url(path + "?key=sesame"), {}, path, {}}, patience);
    REQUIRE_FALSE(text);
    CHECK(text.error().message.find(path) != std::string::npos);
    CHECK(text.error().message.find("sesame") == std::string::npos);
    return text.error().code;
  };
  CHECK(asked("/none", 10s) == ErrorCode::not_found);
  CHECK(asked("/refused", 10s) == ErrorCode::unsupported);
  CHECK(asked("/slow", 100ms) == ErrorCode::unavailable);
}
