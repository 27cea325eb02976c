#include "fetch/fetcher.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "fetch/little_server.h"

using namespace tellurion;
using namespace tellurion::fetch;
using tellurion::test::Ask;
using tellurion::test::LittleServer;
using tellurion::test::Say;
using namespace std::chrono_literals;

namespace {

/// Outcomes of transfers, in the order in which they ended.
class Outcomes {
 public:
  Done taker(std::string name) {
    return [this, name = std::move(name)](Outcome outcome) {
      std::lock_guard lock(mutex_);
      ended_.emplace_back(name, std::move(outcome));
      changed_.notify_all();
    };
  }
  std::vector<std::pair<std::string, Outcome>> wait(std::size_t count) {
    std::unique_lock lock(mutex_);
    REQUIRE(changed_.wait_for(lock, 20s, [&] { return ended_.size() >= count; }));
    return ended_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<std::string, Outcome>> ended_;
};

FetchOptions hasty() {
  FetchOptions options;
  options.first_pause = 10ms;
  options.connect_timeout = 2000ms;
  options.stall_timeout = 1000ms;
  return options;
}

Outcome fetch_one(const LittleServer& server, const std::string& path, FetchOptions options = hasty(), std::vector<std::string> headers = {}) {
  Outcomes outcomes;
  Fetcher fetcher(options);
  fetcher.start({server.url(path), std::move(headers), path, {}}, make_gain(0), outcomes.taker(path));
  return outcomes.wait(1).front().second;
}

}  // namespace

TEST_CASE("Fetcher: bytes, type and lifetime of a file, with the headers that were given") {
  const std::string body("any\0bytes", 9);
  std::string headers;
  const LittleServer server([&](const Ask& ask) {
    headers = ask.headers;
    return Say{.body = body, .headers = {"Content-Type: image/PNG", "ETag: \"7\"", "Cache-Control: public, max-age=90"}};
  });
  const Outcome outcome = fetch_one(server, "/a?b=c", hasty(), {"X-Key: sesame"});
  REQUIRE(outcome);
  CHECK(outcome->body == body);
  CHECK(outcome->content_type == "image/png");
  CHECK(outcome->etag == "\"7\"");
  CHECK(outcome->max_age == 90s);
  CHECK(headers.find("X-Key: sesame\r\n") != std::string::npos);
  CHECK(headers.find("User-Agent: tellurion/") != std::string::npos);
}

TEST_CASE("Fetcher: what is not there is asked for once, what fails in passing again") {
  int failures = 2;
  const LittleServer server([&](const Ask& ask) {
    if (ask.path == "/missing") return Say{.status = 404};
    if (ask.path == "/nothing") return Say{.status = 204};
    if (ask.path == "/private") return Say{.status = 403};
    if (ask.path == "/down") return Say{.status = 503};
    if (ask.path == "/silent") return Say{.hangs_up = true};
    return failures-- > 0 ? Say{.status = 500} : Say{.body = "well"};
  });
  CHECK(fetch_one(server, "/missing").error().code == ErrorCode::not_found);
  CHECK(server.asked("/missing") == 1);
  CHECK(fetch_one(server, "/nothing").error().code == ErrorCode::not_found);
  const Outcome refused = fetch_one(server, "/private");
  CHECK(refused.error().code == ErrorCode::unsupported);
  CHECK(refused.error().message.find("key") != std::string::npos);
  CHECK(server.asked("/private") == 1);
  CHECK(fetch_one(server, "/down").error().code == ErrorCode::unavailable);
  CHECK(server.asked("/down") == 4);
  CHECK(fetch_one(server, "/silent").error().code == ErrorCode::unavailable);
  CHECK(fetch_one(server, "/moody").value().body == "well");
  CHECK(server.asked("/moody") == 3);
}

TEST_CASE("Fetcher: Retry-After is honoured") {
  bool first = true;
  const LittleServer server([&](const Ask&) {
    if (!std::exchange(first, false)) return Say{.body = "now"};
    return Say{.status = 429, .headers = {"Retry-After: 1"}};
  });
  const auto start = std::chrono::steady_clock::now();
  CHECK(fetch_one(server, "/busy").value().body == "now");
  CHECK(std::chrono::steady_clock::now() - start >= 1s);
}

TEST_CASE("Fetcher: cut-off, stalled and endless replies fail; redirects are followed, not for ever") {
  const LittleServer server([](const Ask& ask) {
    if (ask.path == "/cut") return Say{.body = "half", .claims = 8};
    if (ask.path == "/stalled") return Say{.body = "", .after = 5s};
    if (ask.path == "/large") return Say{.body = std::string(5000, 'x')};
    if (ask.path == "/turn") return Say{.status = 302, .headers = {"Location: /there"}};
    if (ask.path == "/there") return Say{.body = "here"};
    return Say{.status = 302, .headers = {"Location: /round"}};
  });
  FetchOptions once = hasty();
  once.most_attempts = 1;
  once.most_bytes = 4000;
  CHECK(fetch_one(server, "/cut", once).error().code == ErrorCode::unavailable);
  CHECK(fetch_one(server, "/stalled", once).error().code == ErrorCode::unavailable);
  CHECK(fetch_one(server, "/large", once).error().code == ErrorCode::exhausted);
  CHECK(fetch_one(server, "/turn", once).value().body == "here");
  CHECK_FALSE(fetch_one(server, "/round", once));
}

TEST_CASE("Fetcher: a source's headers go where redirects lead on the same server, and to no other") {
  const auto remember = [](std::string& headers) {
    return [&](const Ask& ask) {
      headers = ask.headers;
      return Say{.body = "here"};
    };
  };
  std::string told_other;
  const LittleServer other(remember(told_other));
  std::string told;
  const LittleServer server([&](const Ask& ask) {
    if (ask.path == "/away") return Say{.status = 302, .headers = {"Location: " + other.url("/there")}};
    if (ask.path == "/turn") return Say{.status = 307, .headers = {"Location: there"}};
    if (ask.path == "/round") return Say{.status = 302, .headers = {"Location: /round"}};
    return remember(told)(ask);
  });
  CHECK(fetch_one(server, "/turn", hasty(), {"X-Key: sesame"}).value().body == "here");
  CHECK(told.find("X-Key: sesame\r\n") != std::string::npos);
  CHECK(fetch_one(server, "/away", hasty(), {"X-Key: sesame"}).value().body == "here");
  CHECK(told_other.find("sesame") == std::string::npos);
  const Outcome round = fetch_one(server, "/round", hasty(), {"X-Key: sesame"});
  REQUIRE_FALSE(round);
  CHECK(round.error().message.find("more than 5 times") != std::string::npos);
  CHECK(server.asked("/round") == 6);
}

TEST_CASE("Fetcher: other protocols are refused, and messages hold no credentials") {
  Outcomes outcomes;
  Fetcher fetcher(hasty());
  fetcher.start({"file:///etc/passwd", {}, "a", {}}, make_gain(0), outcomes.taker("file"));
  fetcher.start({"http://me:secret@127.0.0.1:1/x?key=secret", {}, "b", {}}, make_gain(0), outcomes.taker("dead"));
  for (const auto& [name, outcome] : outcomes.wait(2)) {
    REQUIRE_FALSE(outcome);
    CHECK(outcome.error().message.find("secret") == std::string::npos);
    CHECK(outcome.error().code == (name == "file" ? ErrorCode::invalid_argument : ErrorCode::unavailable));
  }
}

TEST_CASE("Fetcher: the greatest gain first, within the limit of transfers; cancelled ones end as such") {
  const LittleServer server([](const Ask& ask) { return Say{.body = ask.path, .after = ask.path == "/slow" ? 3000ms : 60ms}; });
  FetchOptions options = hasty();
  options.most_transfers = 2;
  Outcomes outcomes;
  Fetcher fetcher(options);
  std::vector<Fetcher::Ticket> tickets;
  std::vector<Gain> gains;
  for (const double gain : {9.0, 8.0, 1.0, 5.0, 3.0, 4.0}) {
    const std::string path = fmt::format("/{}", gain);
    tickets.push_back(fetcher.start({server.url(path), {}, path, {}}, gains.emplace_back(make_gain(gain)), outcomes.taker(path)));
  }
  gains[4]->store(7.0);
  fetcher.cancel(tickets[5]);
  const auto ended = outcomes.wait(6);
  std::vector<std::string> order;
  for (const auto& [name, outcome] : ended) {
    if (name == "/4") CHECK(outcome.error().code == ErrorCode::cancelled);
    else order.push_back(name);
  }
  const auto place = [&](const char* name) { return std::find(order.begin(), order.end(), name) - order.begin(); };
  CHECK(place("/1") == 4);
  CHECK(place("/3") < 4);
  CHECK(place("/5") < 4);
  CHECK(server.asked("/4") == 0);
  CHECK(server.most_at_once() <= 2);

  Outcomes cut;
  const auto slow = fetcher.start({server.url("/slow"), {}, "/slow", {}}, make_gain(1), cut.taker("/slow"));
  while (server.asked("/slow") == 0) std::this_thread::sleep_for(1ms);
  const auto start = std::chrono::steady_clock::now();
  fetcher.cancel(slow);
  CHECK(cut.wait(1).front().second.error().code == ErrorCode::cancelled);
  CHECK(std::chrono::steady_clock::now() - start < 1s);
  CHECK(fetcher.stats().in_flight == 0);
  CHECK(fetcher.stats().cancelled == 2);
}

TEST_CASE("Fetcher: gains count until a host has a connection free; another host's transfers do not wait for it") {
  const LittleServer slow([](const Ask& ask) { return Say{.body = ask.path, .after = 300ms}; });
  const LittleServer quick([](const Ask& ask) { return Say{.body = ask.path}; });
  FetchOptions options = hasty();
  options.most_per_host = 2;
  Outcomes outcomes;
  std::vector<Gain> gains;
  Fetcher fetcher(options);
  for (int i = 0; i < 6; ++i) {
    const std::string path = fmt::format("/{}", i);
    fetcher.start({slow.url(path), {}, path, {}}, gains.emplace_back(make_gain(10.0 - i)), outcomes.taker(path));
  }
  while (slow.most_at_once() < 2) std::this_thread::sleep_for(1ms);
  gains[5]->store(100.0);
  fetcher.start({quick.url("/quick"), {}, "/quick", {}}, make_gain(-1.0), outcomes.taker("/quick"));
  const auto ended = outcomes.wait(7);
  const auto place = [&](const char* name) { return std::ranges::find(ended, name, [](const auto& one) { return one.first; }) - ended.begin(); };
  CHECK(place("/quick") == 0);
  CHECK(place("/5") <= 4);
}

TEST_CASE("Fetcher: bytes are counted as they come, those of errors are not") {
  const LittleServer server([](const Ask& ask) {
    if (ask.path == "/error") return Say{.status = 404, .body = std::string(500, '!')};
    return Say{.body = std::string(3000, 'x'), .claims = ask.path == "/slow" ? 4000 : -1, .lingers = ask.path == "/slow" ? 5000ms : 0ms};
  });
  Outcomes outcomes;
  Fetcher fetcher(hasty());
  fetcher.start({server.url("/error"), {}, "/error", {}}, make_gain(0), outcomes.taker("/error"));
  fetcher.start({server.url("/whole"), {}, "/whole", {}}, make_gain(0), outcomes.taker("/whole"));
  outcomes.wait(2);
  CHECK(fetcher.stats().bytes == 3000);
  fetcher.start({server.url("/slow"), {}, "/slow", {}}, make_gain(0), outcomes.taker("/slow"));
  for (int i = 0; i < 500 && fetcher.stats().bytes == 3000; ++i) std::this_thread::sleep_for(1ms);
  CHECK(fetcher.stats().bytes == 6000);
  CHECK(fetcher.stats().in_flight == 1);
}

TEST_CASE("Fetcher: a part of a file, and what claims to be one") {
  const std::string file = "0123456789abcdef";
  std::string headers;
  bool was_busy = false;
  const LittleServer server([&](const Ask& ask) {
    headers = ask.headers;
    if (ask.path == "/whole") return Say{.body = file};
    if (ask.path == "/other") return Say{.status = 206, .body = "2345", .headers = {"Content-Range: bytes 2-5/16"}};
    if (ask.path == "/short") return Say{.status = 206, .body = "345", .headers = {"Content-Range: bytes 3-5/16"}};
    if (ask.path == "/silent") return Say{.status = 206, .body = "3456"};
    if (ask.path == "/busy" && !std::exchange(was_busy, true)) return Say{.status = 503, .body = std::string(400, '!')};
    if (ask.path == "/odd") return Say{.status = 206, .body = "3456", .headers = {"Content-Range: bytes 3-6/*"}};
    return test::part_of(file, ask, "\"v1\"");
  });
  const auto part = [&](const std::string& path, ByteRange range) {
    Outcomes outcomes;
    Fetcher fetcher(hasty());
    fetcher.start({server.url(path), {}, path, {}, 0, range}, make_gain(0), outcomes.taker(path));
    return outcomes.wait(1).front().second;
  };
  const Outcome middle = part("/file", {3, 4});
  REQUIRE(middle);
  CHECK(middle->body == "3456");
  CHECK(middle->whole_bytes == 16);
  CHECK(middle->etag == "\"v1\"");
  CHECK(headers.find("Range: bytes=3-6\r\n") != std::string::npos);
  CHECK_MESSAGE(headers.find("Accept-Encoding") == std::string::npos, "the bytes of the file, not of a compressed one");
  CHECK_MESSAGE(part("/busy", {3, 4}).value().body == "3456", "an error's text may be longer than the part");
  CHECK(part("/file", {12, 100}).value().body == "cdef");
  CHECK(part("/whole", {0, 16}).value().body == file);
  CHECK(part("/whole", {0, 16}).value().whole_bytes == 16);
  for (const char* path : {"/whole", "/other", "/short", "/silent", "/odd"}) {
    CAPTURE(path);
    const Outcome wrong = part(path, {3, 4});
    REQUIRE_FALSE(wrong);
    CHECK(wrong.error().code == ErrorCode::unsupported);
    CHECK(wrong.error().message.find("ranges") != std::string::npos);
    CHECK(server.asked(path) <= 3);
  }
  CHECK_FALSE(part("/whole", {0, 8}));
  CHECK_FALSE(part("/file", {16, 4}));
}

TEST_CASE("without_credentials: what names the file stays, what opens the door goes") {
  CHECK(without_credentials("https://a.b/c/1.png?layer=x&apikey=1&Token=2&v=3") == "https://a.b/c/1.png?layer=x&v=3");
  CHECK(without_credentials("https://a.b/c?pwd=1&layer=x&JSESSIONID=2&ticket=3&X-Amz-Credential=4") == "https://a.b/c?layer=x");
  CHECK(without_credentials("http://u:p@a.b/c") == "http://a.b/c");
  CHECK(public_part("http://u:p@a.b:80/c?d#e") == "http://a.b:80/c");
  CHECK(public_part("http://a.b/c@d") == "http://a.b/c@d");
}
