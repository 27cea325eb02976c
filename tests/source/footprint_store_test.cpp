#include "source/catalogue/footprint_store.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "source/made_archive.h"

using namespace tellurion;
using namespace tellurion::source;
using test::Folder;
namespace fs = std::filesystem;

namespace {

std::unique_ptr<FootprintStore> opened(const fs::path& file) {
  auto store = FootprintStore::open(file);
  REQUIRE_MESSAGE(store, store.error().message);
  return std::move(store).value();
}

/// `count` places that depend on `seed`.
KeptFootprint footprint(unsigned seed, std::size_t count = 32) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(-3.2, 3.2);
  KeptFootprint made{{}, Metres(0.1 + seed)};
  for (std::size_t i = 0; i < count; ++i) made.ring.push_back({Radians(angle(random) / 2.1), Radians(angle(random))});
  return made;
}

void check_same(const std::optional<KeptFootprint>& found, const KeptFootprint& wanted) {
  REQUIRE(found);
  CHECK(found->spacing == wanted.spacing);
  REQUIRE(found->ring.size() == wanted.ring.size());
  for (std::size_t i = 0; i < wanted.ring.size(); ++i) {
    REQUIRE(found->ring[i].latitude == wanted.ring[i].latitude);
    REQUIRE(found->ring[i].longitude == wanted.ring[i].longitude);
  }
}

/// Runs SQL on the file as another program would.
void alter(const fs::path& file, const std::string& sql) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &database) == SQLITE_OK);
  char* message = nullptr;
  const int status = sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &message);
  CHECK_MESSAGE(status == SQLITE_OK, (message != nullptr ? message : ""));
  sqlite3_free(message);
  sqlite3_close(database);
}

std::int64_t count(const fs::path& file) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &database) == SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  REQUIRE(sqlite3_prepare_v2(database, "SELECT COUNT(*) FROM footprints", -1, &statement, nullptr) == SQLITE_OK);
  REQUIRE(sqlite3_step(statement) == SQLITE_ROW);
  const std::int64_t number = sqlite3_column_int64(statement, 0);
  sqlite3_finalize(statement);
  sqlite3_close(database);
  return number;
}

}  // namespace

TEST_CASE("FootprintStore: what is kept is found bit by bit, also after the file is opened again") {
  const Folder folder("footprints");
  const fs::path file = folder / "deep/er/footprints.sqlite";
  {
    const auto store = opened(file);
    CHECK_FALSE(store->find("/a.tif", "1"));
    store->keep({{"/a.tif", "1", footprint(1)}, {"/b \xc3\xa4'.tif", "2", footprint(2, 4)}, {"/nowhere.tif", "3", {{}, Metres(7.0)}}});
    check_same(store->find("/a.tif", "1"), footprint(1));
  }
  const auto store = opened(file);
  check_same(store->find("/a.tif", "1"), footprint(1));
  check_same(store->find("/b \xc3\xa4'.tif", "2"), footprint(2, 4));
  check_same(store->find("/nowhere.tif", "3"), {{}, Metres(7.0)});
  CHECK_FALSE(store->find("/A.tif", "1"));
  CHECK_FALSE(store->find("/a.tif", ""));
}

TEST_CASE("FootprintStore: a raster that has changed is not found, and its new footprint replaces the old one") {
  const Folder folder("footprints_revision");
  const auto store = opened(folder / "f.sqlite");
  store->keep({{"/a.tif", "old", footprint(1)}});
  CHECK_FALSE(store->find("/a.tif", "new"));
  store->keep({{"/a.tif", "new", footprint(2)}});
  check_same(store->find("/a.tif", "new"), footprint(2));
  CHECK_FALSE(store->find("/a.tif", "old"));
  CHECK(count(folder / "f.sqlite") == 1);
}

TEST_CASE("FootprintStore: damaged rows count as not kept, the others are found") {
  const Folder folder("footprints_rows");
  const fs::path file = folder / "f.sqlite";
  const auto store = opened(file);
  std::vector<FootprintStore::Entry> entries;
  for (unsigned i = 0; i < 8; ++i) entries.push_back({fmt::format("/{}.tif", i), "r", footprint(i)});
  KeptFootprint not_a_number = footprint(8);
  not_a_number.ring[3].longitude = Radians(std::numeric_limits<double>::quiet_NaN());
  entries.push_back({"/8.tif", "r", not_a_number});
  store->keep(entries);
  alter(file, "UPDATE footprints SET footprint = substr(footprint, 1, 40) WHERE path = '/1.tif';"    // cut off between two places
              "UPDATE footprints SET footprint = substr(footprint, 1, 37) WHERE path = '/2.tif';"
              "UPDATE footprints SET footprint = x'' WHERE path = '/3.tif';"
              "UPDATE footprints SET footprint = 'text' WHERE path = '/4.tif';"
              "UPDATE footprints SET checksum = checksum + 1 WHERE path = '/5.tif';"
              "UPDATE footprints SET footprint = (SELECT footprint FROM footprints WHERE path = '/0.tif') WHERE path = '/6.tif'");
  for (const char* path : {"/1.tif", "/2.tif", "/3.tif", "/4.tif", "/5.tif", "/6.tif", "/8.tif"}) {
    CAPTURE(path);
    CHECK_FALSE(store->find(path, "r"));
  }
  check_same(store->find("/0.tif", "r"), footprint(0));
  check_same(store->find("/7.tif", "r"), footprint(7));
  store->keep({{"/5.tif", "r", footprint(50)}});
  check_same(store->find("/5.tif", "r"), footprint(50));
}

TEST_CASE("FootprintStore: a file that is no database, or is damaged, is set aside and made anew") {
  const Folder folder("footprints_damaged");
  const fs::path file = folder / "f.sqlite";
  SUBCASE("text") { test::write_file(file, "not a database, but some text that is long enough to be looked at as the header of one"); }
  SUBCASE("other tables") { alter(file, "CREATE TABLE footprints (name TEXT); PRAGMA user_version = 1"); }
  SUBCASE("overwritten") {
    opened(file)->keep({{"/a.tif", "1", footprint(1)}});
    std::fstream(file, std::ios::binary | std::ios::in | std::ios::out) << std::string(4000, 'x');
  }
  SUBCASE("a negative version") { alter(file, "PRAGMA user_version = -3"); }
  const auto store = opened(file);
  CHECK_FALSE(store->find("/a.tif", "1"));
  store->keep({{"/a.tif", "1", footprint(2)}});
  check_same(store->find("/a.tif", "1"), footprint(2));
  CHECK(fs::exists(file.string() + ".damaged"));
}

TEST_CASE("FootprintStore: damage that only shows later costs what was kept, and no more") {
  const Folder folder("footprints_later");
  const fs::path file = folder / "f.sqlite";
  std::vector<FootprintStore::Entry> entries;
  for (unsigned i = 0; i < 400; ++i) entries.push_back({fmt::format("/{}.tif", i), "r", footprint(i)});
  opened(file)->keep(entries);
  const auto size = fs::file_size(file);
  REQUIRE(size > 3 * 4096 + 8192);
  {
    std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);  // all but the page with the header and the tables' names
    stream.seekp(4096);
    stream << std::string(static_cast<std::size_t>(size) - 4096, '\x7f');
  }
  const auto store = opened(file);
  CHECK_FALSE(store->find("/7.tif", "r"));
  store->keep({{"/7.tif", "r", footprint(7)}});
  check_same(store->find("/7.tif", "r"), footprint(7));
}

TEST_CASE("FootprintStore: errors name the file; a later version's file is left as it is") {
  const Folder folder("footprints_errors");
  const auto check_refused = [](const fs::path& file) {
    const auto store = FootprintStore::open(file);
    REQUIRE_FALSE(store);
    CHECK(store.error().code == ErrorCode::unavailable);
    CHECK(store.error().message.find(file.string()) != std::string::npos);
  };
  fs::create_directories(folder / "is_a_folder.sqlite");
  check_refused(folder / "is_a_folder.sqlite");
  test::write_file(folder / "file", "");
  check_refused(folder / "file/f.sqlite");
  alter(folder / "later.sqlite", "PRAGMA user_version = 99");
  check_refused(folder / "later.sqlite");
  CHECK_FALSE(fs::exists(folder / "later.sqlite.damaged"));
}

TEST_CASE("FootprintStore: two stores on a file and two threads on each keep all that is kept") {
  const Folder folder("footprints_shared");
  const fs::path file = folder / "f.sqlite";
  const auto one = opened(file), other = opened(file);
  constexpr unsigned kEach = 25;
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      FootprintStore& store = t % 2 == 0 ? *one : *other;
      for (unsigned i = 0; i < kEach; ++i) {
        const std::string path = fmt::format("/{}/{}.tif", t, i);
        store.keep({{path, "r", footprint(100 * t + i)}});
        store.find(path, "r");
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (unsigned t = 0; t < 4; ++t) {
    for (unsigned i = 0; i < kEach; ++i) check_same((t % 2 == 0 ? *other : *one).find(fmt::format("/{}/{}.tif", t, i), "r"), footprint(100 * t + i));
  }
  CHECK(count(file) == 4 * kEach);
}
