// Sources over services, which a small server on loopback stands for.
#include "source/tiles/service_source.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sqlite3.h>

#include "fetch/little_server.h"
#include "source/made_archive.h"
#include "source/service_documents.h"

using namespace tellurion;
using namespace tellurion::source;
using test::Ask;
using test::LittleServer;
using test::Say;

namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
  return text;
}

std::shared_ptr<fetch::ByteStore> made_store(const std::filesystem::path& disk_file = {}) {
  fetch::StoreOptions options;
  options.disk_file = disk_file;
  options.fetch.first_pause = std::chrono::milliseconds(10);
  return std::make_shared<fetch::ByteStore>(options);
}

/// Asks for the tiles below the pixel until they are there, or until one fails.
void look(const RasterSource& source, const PixelWindow& window) {
  const auto reader = source.open_reader();
  REQUIRE(reader);
  for (int round = 0; round < 20; ++round) {
    const auto image = (*reader)->read_colours(0, window);
    if (image || image.error().code != ErrorCode::pending) return;
    for (const auto& arrival : (*reader)->take_awaited()) arrival->wait({});
  }
}

/// What a disk cache knows files by.
std::vector<std::string> keys_in(const std::filesystem::path& file) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READONLY, nullptr) == SQLITE_OK);
  std::vector<std::string> keys;
  const auto add = [](void* list, int, char** values, char**) {
    static_cast<std::vector<std::string>*>(list)->emplace_back(values[0]);
    return 0;
  };
  REQUIRE(sqlite3_exec(database, "SELECT key FROM files", add, &keys, nullptr) == SQLITE_OK);
  sqlite3_close(database);
  return keys;
}

ServiceOptions wms(const std::string& url) {
  ServiceOptions options;
  options.url = url;
  options.layer = "ground";
  options.crs = "EPSG:4326";
  return options;
}

}  // namespace

TEST_CASE("open_wms: headers and keys go to the server of the user's URL only") {
  for (const bool elsewhere : {false, true}) {
    std::mutex mutex;
    std::vector<Ask> asks;
    const auto note = [&](const Ask& ask) {
      std::lock_guard lock(mutex);
      asks.push_back(ask);
    };
    const LittleServer other([&](const Ask& ask) {
      note(ask);
      return Say{.body = test::plain_png(64, 1, 2, 3)};
    });
    std::string capabilities;
    const LittleServer server([&](const Ask& ask) {
      if (has(ask.path, "GetCapabilities")) return Say{.body = capabilities};
      note(ask);
      return Say{.body = test::plain_png(64, 1, 2, 3)};
    });
    capabilities = replaced(test_services::kWms13, "http://h/wms?map=a&amp;", elsewhere ? other.url("/map?") : server.url("/map?"));
    ServiceOptions options = wms(server.url("/caps?key=sesame"));
    options.headers = {"Authorization: Bearer barley"};
    options.tile_size = 64;
    options.most_level = 2;
    const auto source = open_wms(options, geo::kWgs84, made_store());
    REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
    look(**source, {400, 120, 8, 8});
    REQUIRE_FALSE(asks.empty());
    for (const Ask& ask : asks) {
      CHECK(has(ask.headers, "barley") != elsewhere);
      CHECK(has(ask.path, "sesame") != elsewhere);
    }
  }
}

TEST_CASE("open_wms: a service's words about the key are shown without it") {
  const LittleServer server([](const Ask&) {
    return Say{.body = "<ServiceExceptionReport><ServiceException>sesame is no key</ServiceException></ServiceExceptionReport>"};
  });
  const auto source = open_wms(wms(server.url("/caps?key=sesame")), geo::kWgs84, made_store());
  REQUIRE_FALSE(source);
  CHECK(has(source.error().message, "is no key"));
  CHECK_FALSE(has(source.error().message, "sesame"));
}

TEST_CASE("open_wms: the finest level is the last one within the service's scales") {
  const LittleServer server([](const Ask&) { return Say{.body = test_services::kWms13}; });
  ServiceOptions options = wms(server.url("/caps"));
  options.layer = "roads";
  options.crs = "EPSG:3857";
  options.tile_size = 128;
  const auto source = open_wms(options, geo::kWgs84, made_store());
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  // 1:5000 is a pixel of 1.4 m; the Earth's 40075 km halved to pixels of 2.39 m (2^24) are coarser, those of 1.19 m (2^25) finer.
  CHECK((*source)->description().levels.front().width == 1 << 24);
}

TEST_CASE("open_wms: tiles are kept by their own URL, without its key, and by all dimensions") {
  const test::Folder folder("service_keys");
  const LittleServer server([](const Ask& ask) {
    if (has(ask.path, "GetCapabilities")) return Say{.body = replaced(test_services::kWms13, "http://h/wms", "/map")};
    return Say{.body = test::plain_png(64, 1, 2, 3)};
  });
  {
    const auto store = made_store(folder / "files.sqlite");
    for (const char* sigma : {"1", "2"}) {
      ServiceOptions options = wms(server.url("/caps?key=sesame"));
      options.dimensions = {{"sigma", sigma}};  // looks like a signature
      options.tile_size = 64;
      options.most_level = 2;
      const auto source = open_wms(options, geo::kWgs84, store);
      REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
      look(**source, {400, 120, 8, 8});
    }
  }
  std::vector<std::string> keys = keys_in(folder / "files.sqlite");
  keys.erase(std::remove_if(keys.begin(), keys.end(), [](const std::string& key) { return !has(key, "GetMap"); }), keys.end());
  std::sort(keys.begin(), keys.end());
  REQUIRE(keys.size() >= 2);
  CHECK(keys.size() % 2 == 0);
  CHECK(std::adjacent_find(keys.begin(), keys.end()) == keys.end());
  for (const std::string& key : keys) {
    CHECK(has(key, "BBOX="));
    CHECK_FALSE(has(key, "sesame"));
  }
}

TEST_CASE("open_wms: what two layers with tens of thousands of CRSs have in common is found at once") {
  std::string first, second;
  for (int i = 0; i < 30'000; ++i) {
    first += "<CRS>EPSG:" + std::to_string(1'000'000 + i) + "</CRS>";
    second += "<CRS>EPSG:" + std::to_string(1'100'000 + i) + "</CRS>";
  }
  const std::string box = R"(<EX_GeographicBoundingBox><westBoundLongitude>0</westBoundLongitude><eastBoundLongitude>1</eastBoundLongitude><southBoundLatitude>0</southBoundLatitude>
    <northBoundLatitude>1</northBoundLatitude></EX_GeographicBoundingBox>)";
  const std::string capabilities = R"(<WMS_Capabilities version="1.3.0"><Capability><Request><GetMap><Format>image/png</Format></GetMap></Request><Layer><Layer><Name>a</Name>)" + first +
                                   "<CRS>urn:ogc:def:crs:EPSG::4326</CRS>" + box + "</Layer><Layer><Name>b</Name>" + second + "<CRS>EPSG:4326</CRS>" + box +
                                   "</Layer></Layer></Capability></WMS_Capabilities>";
  const LittleServer server([&](const Ask&) { return Say{.body = capabilities}; });
  ServiceOptions options;
  options.url = server.url("/caps");
  options.layer = "a,b";
  const auto start = std::chrono::steady_clock::now();
  const auto source = open_wms(options, geo::kWgs84, made_store());
  REQUIRE_MESSAGE(source, (source ? "" : source.error().message));
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(20));
  CHECK((*source)->description().crs_name == "WGS 84");
}
