#include "fetch/remote_file.h"

#include <atomic>
#include <filesystem>
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
  Folder() : path_(fs::temp_directory_path() / fmt::format("tellurion_remote_{}", getpid())) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path file() const { return path_ / "files.sqlite"; }

 private:
  fs::path path_;
};

std::shared_ptr<ByteStore> store_in(const fs::path& file, bool offline = false) {
  StoreOptions options;
  options.disk_file = file;
  options.offline = offline;
  options.fetch.first_pause = 10ms;
  options.pause_after_failure = 10ms;
  return std::make_shared<ByteStore>(options);
}

std::string text_of(const Result<std::shared_ptr<const std::string>>& bytes) { return bytes ? **bytes : bytes.error().message; }

const std::string kFile = "The head of the file, then its middle, and the end.";

}  // namespace

TEST_CASE("RemoteFile: parts are fetched once, and again not even in the next run") {
  std::atomic<int> requests{0};
  const LittleServer server([&](const Ask& ask) {
    ++requests;
    return test::part_of(kFile, ask, "\"1\"");
  });
  const Folder folder;
  const std::string url = server.url("/a.bin?key=secret");
  for (const bool offline : {false, false, true}) {
    const auto file = RemoteFile::open(store_in(folder.file(), offline), url, {}, 8, 5s);
    REQUIRE(file);
    const RemoteFile& f = **file;
    CHECK(*f.head() == "The head");
    CHECK(f.size() == kFile.size());
    CHECK(f.name().find("secret") == std::string::npos);
    CHECK(text_of(f.wait_for({22, 4}, 5s)) == "then");
    CHECK(text_of(f.wait_for({22, 4}, 5s)) == "then");
    CHECK(text_of(f.wait_for({4, 4}, 5s)) == "head");
    CHECK(text_of(f.wait_for({kFile.size() - 4, 4}, 5s)) == "end.");
    const auto beyond = f.wait_for({kFile.size() - 4, 5}, 5s);
    REQUIRE_FALSE(beyond);
    CHECK(beyond.error().code == ErrorCode::corrupt);
    CHECK(f.wait_for({~std::uint64_t{0}, 2}, 5s).error().code == ErrorCode::corrupt);
    CHECK(requests == 3);
  }
}

TEST_CASE("RemoteFile: parts of two versions are never mixed, and opening it again shows the new one") {
  const std::string other = "Another head, and all the rest is other than before";
  REQUIRE(other.size() == kFile.size());
  for (const char* version : {"ETag: \"{}\"", "Last-Modified: Sun, 0{} Nov 2026 12:00:00 GMT"}) {
    CAPTURE(version);
    std::atomic<bool> changed{false};
    const LittleServer server([&](const Ask& ask) {
      Say say = test::part_of(changed ? other : kFile, ask);
      say.headers.push_back(fmt::format(fmt::runtime(version), changed ? 2 : 1));
      return say;
    });
    const Folder folder;
    const auto store = store_in(folder.file());
    const auto file = RemoteFile::open(store, server.url("/a"), {}, 8, 5s);
    REQUIRE(file);
    CHECK(text_of((*file)->wait_for({22, 4}, 5s)) == "then");
    changed = true;
    const auto mixed = (*file)->wait_for({40, 4}, 5s);
    REQUIRE_FALSE(mixed);
    CHECK(mixed.error().code == ErrorCode::unavailable);
    CHECK(mixed.error().message.find("changed") != std::string::npos);
    CHECK(text_of((*file)->wait_for({22, 4}, 5s)) == "then");
    std::this_thread::sleep_for(30ms);
    const auto again = RemoteFile::open(store, server.url("/a"), {}, 8, 5s);
    REQUIRE(again);
    CHECK(*(*again)->head() == "Another ");
    CHECK(text_of((*again)->wait_for({22, 4}, 5s)) == other.substr(22, 4));
    CHECK((*again)->revision() != (*file)->revision());
  }
}

TEST_CASE("RemoteFile: what was rejected is fetched anew") {
  std::atomic<int> requests{0};
  const LittleServer server([&](const Ask& ask) {
    ++requests;
    return test::part_of(kFile, ask, "\"1\"");
  });
  const Folder folder;
  const auto open = [&] { return RemoteFile::open(store_in(folder.file()), server.url("/a"), {}, 8, 5s); };
  const auto file = open();
  REQUIRE(file);
  CHECK(text_of((*file)->wait_for({22, 4}, 5s)) == "then");
  CHECK(requests == 2);
  (*file)->reject({22, 4}, "is worthless");
  CHECK(text_of((*file)->wait_for({22, 4}, 5s)) == "is worthless");
  std::this_thread::sleep_for(30ms);
  CHECK(text_of((*file)->wait_for({22, 4}, 5s)) == "then");
  CHECK(requests == 3);
  (*file)->reject({2, 3}, "is worthless");
  CHECK(open());
  CHECK(requests == 4);
}

TEST_CASE("RemoteFile: what is not there, does not answer or gives no parts is said") {
  const LittleServer server([](const Ask& ask) {
    if (ask.path == "/whole") return Say{.body = std::string(100, 'x')};
    if (ask.path == "/slow") return Say{.body = "x", .after = 3s};
    return Say{.status = 404};
  });
  const Folder folder;
  const auto store = store_in(folder.file());
  const auto open = [&](const std::string& path) { return RemoteFile::open(store, server.url(path), {}, 8, 300ms); };
  CHECK(open("/none").error().code == ErrorCode::not_found);
  CHECK(open("/slow").error().code == ErrorCode::unavailable);
  const auto whole = open("/whole");
  REQUIRE_FALSE(whole);
  CHECK(whole.error().message.find("ranges") != std::string::npos);
}

TEST_CASE("DiskCache: files kept by an earlier version are still there") {
  const Folder folder;
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(folder.file().c_str(), &database) == SQLITE_OK);
  // As version 1 made it; the checksum is FNV-1a of "body" and three times that of "k".
  const auto hash = [](const std::string& text) {
    std::uint64_t value = 0xcbf29ce484222325ull;
    for (const unsigned char byte : text) value = (value ^ byte) * 0x100000001b3ull;
    return value;
  };
  const auto checksum = static_cast<std::int64_t>(hash("body") ^ (hash("k") * 3));
  const std::string make = fmt::format(
      "CREATE TABLE files (key TEXT PRIMARY KEY, body BLOB NOT NULL, missing INTEGER NOT NULL, etag TEXT NOT NULL, type TEXT NOT NULL,"
      " expires INTEGER NOT NULL, used INTEGER NOT NULL, bytes INTEGER NOT NULL, checksum INTEGER NOT NULL);"
      "INSERT INTO files VALUES ('k', CAST('body' AS BLOB), 0, '\"e\"', 'image/png', 4000000000, 1, 5, {}); PRAGMA user_version = 1;", checksum);
  REQUIRE(sqlite3_exec(database, make.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(database);
  const auto cache = DiskCache::open(folder.file(), 1 << 20);
  REQUIRE(cache);
  const auto old = (*cache)->find("k");
  REQUIRE(old);
  CHECK(old->body == "body");
  CHECK(old->whole_bytes == 0);
  DiskEntry part{"part", false, "\"e\"", {}, std::chrono::system_clock::now() + 1h, 1234};
  (*cache)->put("p", part);
  CHECK((*cache)->find("p")->whole_bytes == 1234);
  CHECK_FALSE(fs::exists(folder.file().string() + ".damaged"));
}
