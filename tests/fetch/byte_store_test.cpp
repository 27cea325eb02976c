#include "fetch/byte_store.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <doctest/doctest.h>
#include <sqlite3.h>
#include <unistd.h>

#include "fetch/disk_cache.h"
#include "fetch/little_server.h"

using namespace tellurion;
using namespace tellurion::fetch;
using tellurion::test::Ask;
using tellurion::test::LittleServer;
using tellurion::test::Say;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / fmt::format("tellurion_store_{}", getpid())) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path file() const { return path_ / "deep" / "files.sqlite"; }

 private:
  fs::path path_;
};

StoreOptions options_for(const fs::path& file) {
  StoreOptions options;
  options.disk_file = file;
  options.fetch.first_pause = 10ms;
  options.pause_after_failure = 50ms;
  return options;
}

Request request_of(const LittleServer& server, const std::string& path) { return {server.url(path), {}, path, {}}; }

/// Asks until there is an answer.
std::variant<File, Error> answer(ByteStore& store, const Request& request) {
  for (;;) {
    Asked asked = store.ask(request);
    if (auto* file = std::get_if<File>(&asked)) return *file;
    if (auto* error = std::get_if<Error>(&asked)) return *error;
    std::get<std::shared_ptr<Arrival>>(asked)->wait({});
  }
}

std::string body(ByteStore& store, const Request& request) {
  const auto got = answer(store, request);
  REQUIRE(std::holds_alternative<File>(got));
  REQUIRE(std::get<File>(got).bytes);
  return *std::get<File>(got).bytes;
}

}  // namespace

TEST_CASE("ByteStore: a file is fetched once, by whom and how often it is asked for, and the next run has it from disk") {
  const LittleServer server([](const Ask& ask) { return Say{.body = "this is " + ask.path, .headers = {"Content-Type: image/png"}, .after = 30ms}; });
  const Folder folder;
  const Request request = request_of(server, "/1");
  {
    ByteStore store(options_for(folder.file()));
    const Asked first = store.ask(request), second = store.ask(request);
    CHECK(std::get<std::shared_ptr<Arrival>>(first) == std::get<std::shared_ptr<Arrival>>(second));
    CHECK(body(store, request) == "this is /1");
    CHECK(body(store, request) == "this is /1");
    CHECK(store.disk_bytes() > 9);
  }
  ByteStore again(options_for(folder.file()));
  const Asked kept = again.ask(request);
  REQUIRE(std::holds_alternative<File>(kept));
  CHECK(*std::get<File>(kept).bytes == "this is /1");
  CHECK(std::get<File>(kept).content_type == "image/png");
  CHECK(server.asked("/1") == 1);
}

TEST_CASE("ByteStore: what does not exist is believed for a while, what failed is asked for again") {
  int bad = 5;
  const LittleServer server([&](const Ask& ask) {
    if (ask.path == "/none") return Say{.status = 404};
    return bad-- > 0 ? Say{.status = 500} : Say{.body = "at last"};
  });
  const Folder folder;
  ByteStore store(options_for(folder.file()));
  for (int i = 0; i < 3; ++i) CHECK(std::get<File>(answer(store, request_of(server, "/none"))).bytes == nullptr);
  CHECK(server.asked("/none") == 1);
  CHECK(std::get<Error>(answer(store, request_of(server, "/moody"))).code == ErrorCode::unavailable);
  CHECK(server.asked("/moody") == 4);
  CHECK(std::holds_alternative<Error>(store.ask(request_of(server, "/moody"))));
  std::this_thread::sleep_for(60ms);
  CHECK(body(store, request_of(server, "/moody")) == "at last");
  ByteStore other(options_for(folder.file()));
  CHECK(std::get<File>(other.ask(request_of(server, "/none"))).bytes == nullptr);
}

TEST_CASE("ByteStore: what no disk cache takes is counted") {
  const LittleServer server([](const Ask& ask) { return Say{.body = std::string(ask.path == "/large" ? 3000 : 30, 'x')}; });
  const Folder folder;
  StoreOptions options = options_for(folder.file());
  options.disk_bytes = 10'000;
  {
    ByteStore store(options);
    body(store, request_of(server, "/small"));
    CHECK(store.stats().not_kept == 0);
    body(store, request_of(server, "/large"));
    CHECK(store.stats().not_kept == 1);
  }
  options.disk_file = folder.file().parent_path();  // cannot be opened
  ByteStore store(options);
  body(store, request_of(server, "/small"));
  CHECK(store.stats().not_kept == 1);
}

TEST_CASE("ByteStore: a server that asks for a long pause is not asked again before") {
  const LittleServer server([](const Ask& ask) { return Say{.status = 503, .headers = {ask.path == "/hour" ? "Retry-After: 7200" : "Retry-After: 1"}}; });
  const Folder folder;
  StoreOptions options = options_for(folder.file());
  options.fetch.longest_pause = 0s;
  ByteStore store(options);
  for (const char* path : {"/hour", "/second"}) {
    CHECK(std::get<Error>(answer(store, request_of(server, path))).code == ErrorCode::unavailable);
    CHECK(server.asked(path) == 1);
  }
  std::this_thread::sleep_for(200ms);
  for (const char* path : {"/hour", "/second"}) CHECK(std::holds_alternative<Error>(store.ask(request_of(server, path))));
  std::this_thread::sleep_for(1s);
  CHECK(std::holds_alternative<Error>(store.ask(request_of(server, "/hour"))));
  CHECK(std::holds_alternative<std::shared_ptr<Arrival>>(store.ask(request_of(server, "/second"))));
}

TEST_CASE("ByteStore: an expired file is asked for by its tag, and kept if it has not changed") {
  std::string version = "1";
  const LittleServer server([&](const Ask& ask) {
    const std::string tag = "\"v" + version + "\"";
    if (ask.headers.find("If-None-Match: " + tag) != std::string::npos) return Say{.status = 304, .headers = {"ETag: " + tag, "Cache-Control: max-age=0"}};
    return Say{.body = "version " + version, .headers = {"ETag: " + tag, "Cache-Control: max-age=0"}};
  });
  const Folder folder;
  const Request request = request_of(server, "/a");
  for (const char* now : {"1", "1", "2"}) {
    version = now;
    ByteStore store(options_for(folder.file()));
    CHECK(body(store, request) == "version " + version);
  }
  CHECK(server.asked("/a") == 3);
}

TEST_CASE("ByteStore: offline, what is on disk counts however old, and nothing is fetched") {
  const LittleServer server([](const Ask&) { return Say{.body = "old", .headers = {"Cache-Control: max-age=0"}}; });
  const Folder folder;
  { CHECK([&] { ByteStore store(options_for(folder.file())); return body(store, request_of(server, "/a")); }() == "old"); }
  StoreOptions options = options_for(folder.file());
  options.offline = true;
  ByteStore store(options);
  CHECK(body(store, request_of(server, "/a")) == "old");
  const Asked none = store.ask(request_of(server, "/b"));
  REQUIRE(std::holds_alternative<Error>(none));
  CHECK(std::get<Error>(none).message.find("--offline") != std::string::npos);
  CHECK(server.asked("/a") == 1);
  CHECK(server.asked("/b") == 0);
}

TEST_CASE("ByteStore: a transfer that nobody waits for is cancelled; a rejected file is fetched anew") {
  const LittleServer server([](const Ask& ask) { return Say{.body = "x", .after = ask.path == "/slow" ? 5000ms : 0ms}; });
  const Folder folder;
  ByteStore store(options_for(folder.file()));
  { const Asked asked = store.ask(request_of(server, "/slow")); }
  for (int i = 0; i < 200 && store.stats().cancelled == 0; ++i) std::this_thread::sleep_for(10ms);
  CHECK(store.stats().cancelled == 1);

  const Request request = request_of(server, "/page");
  body(store, request);
  store.reject(request.key, "an error page");
  CHECK(std::get<Error>(store.ask(request)).message == "an error page");
  std::this_thread::sleep_for(60ms);
  body(store, request);
  CHECK(server.asked("/page") == 2);
}

TEST_CASE("DiskCache: keeps to its budget, oldest first, and gives out no damaged file") {
  const Folder folder;
  auto cache = std::move(DiskCache::open(folder.file(), 100'000)).value();
  const auto later = std::chrono::system_clock::now() + 1h;
  for (int i = 0; i < 50; ++i) cache->put(fmt::format("{:02}", i), {std::string(5000, static_cast<char>('a' + i % 26)), false, {}, {}, later});
  const DiskCache::Contents contents = cache->contents();
  CHECK(contents.bytes <= 100'000);
  CHECK(contents.bytes > 80'000);
  CHECK(cache->find("49")->body == std::string(5000, static_cast<char>('a' + 49 % 26)));
  CHECK_FALSE(cache->find("00"));
  CHECK(cache->verify() == 0);

  cache.reset();
  std::ofstream(folder.file(), std::ios::trunc) << "this is no database at all, and long enough to be read as one";
  cache = std::move(DiskCache::open(folder.file(), 100'000)).value();
  CHECK(fs::exists(folder.file().string() + ".damaged"));
  cache->put("new", {"begun", false, {}, {}, later});
  CHECK(cache->find("new")->body == "begun");
  cache->clear();
  CHECK_FALSE(fs::exists(folder.file().string() + ".damaged"));
}

TEST_CASE("DiskCache: what cannot be opened for now, or is a later version's, is left as it is") {
  const Folder folder;
  const auto later = std::chrono::system_clock::now() + 1h;
  std::move(DiskCache::open(folder.file(), 100'000)).value()->put("kept", {"body", false, {}, {}, later});
  const auto refused = [&](const char* command, const char* why) {
    sqlite3* database = nullptr;
    REQUIRE(sqlite3_open(folder.file().c_str(), &database) == SQLITE_OK);
    REQUIRE(sqlite3_exec(database, command, nullptr, nullptr, nullptr) == SQLITE_OK);
    const auto cache = DiskCache::open(folder.file(), 100'000);
    REQUIRE_FALSE(cache);
    CHECK(cache.error().message.find(why) != std::string::npos);
    CHECK(cache.error().message.find(folder.file().string()) != std::string::npos);
    CHECK_FALSE(fs::exists(folder.file().string() + ".damaged"));
    sqlite3_close(database);
  };
  refused("PRAGMA user_version = 99", "a later version");
  refused("PRAGMA user_version = 2; PRAGMA journal_mode = DELETE; BEGIN EXCLUSIVE", "another program");
  CHECK(std::move(DiskCache::open(folder.file(), 100'000)).value()->find("kept")->body == "body");
  const fs::path inside = folder.file().parent_path();  // a folder is no file
  const auto cache = DiskCache::open(inside, 100'000);
  REQUIRE_FALSE(cache);
  CHECK(cache.error().message.find("cannot be opened") != std::string::npos);
  CHECK(fs::is_directory(inside));
}

TEST_CASE("DiskCache: a cleared one takes no room, nor one that was made without auto_vacuum, and a smaller budget shrinks it") {
  const Folder folder;
  fs::create_directories(folder.file().parent_path());
  const auto later = std::chrono::system_clock::now() + 1h;
  for (const bool old : {false, true}) {
    CAPTURE(old);
    if (old) {
      sqlite3* database = nullptr;
      REQUIRE(sqlite3_open(folder.file().c_str(), &database) == SQLITE_OK);
      REQUIRE(sqlite3_exec(database, "PRAGMA journal_mode = DELETE; PRAGMA auto_vacuum = NONE; VACUUM", nullptr, nullptr, nullptr) == SQLITE_OK);
      sqlite3_close(database);
    }
    auto cache = std::move(DiskCache::open(folder.file(), 10'000'000)).value();
    for (int i = 0; i < 100; ++i) cache->put(fmt::format("{}", i), {std::string(20'000, 'x'), false, {}, {}, later});
    CHECK(cache->bytes() > 2'000'000);
    cache->clear();
    CHECK(cache->contents().entries == 0);
    CHECK(cache->bytes() == 0);
    cache.reset();
    CHECK(fs::file_size(folder.file()) < 100'000);
  }
  auto cache = std::move(DiskCache::open(folder.file(), 10'000'000)).value();
  for (int i = 0; i < 100; ++i) cache->put(fmt::format("{}", i), {std::string(20'000, 'x'), false, {}, {}, later});
  cache = std::move(DiskCache::open(folder.file(), 500'000)).value();
  cache->put("more", {"than fits", false, {}, {}, later});
  CHECK(cache->bytes() <= 500'000);
  cache.reset();
  CHECK(fs::file_size(folder.file()) < 800'000);
}
