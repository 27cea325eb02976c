#include "source/tiles/tile_template.h"

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::source;

namespace {

std::string url_of(const std::string& text, const TileAddress& tile, std::vector<std::string> subdomains = {}) {
  return std::move(TileTemplate::parse(text, std::move(subdomains))).value().url(tile, std::int64_t{1} << tile.zoom);
}

}  // namespace

TEST_CASE("TileTemplate: every field") {
  CHECK(url_of("http://h/{z}/{x}/{y}.png?a={z}", {3, 5, 2}) == "http://h/3/5/2.png?a=3");
  CHECK(url_of("http://h/{z}/{x}/{-y}", {3, 5, 2}) == "http://h/3/5/5");
  CHECK(url_of("http://{s}.h/{z}/{x}/{y}", {3, 5, 2}, {"a", "b"}) == "http://b.h/3/5/2");
  // The example of Microsoft's "Bing Maps Tile System": tile (3, 5) at level 3.
  CHECK(url_of("http://h/{q}", {3, 3, 5}) == "http://h/213");
  CHECK(url_of("http://h/{q}.jpg", {0, 0, 0}) == "http://h/.jpg");
}

TEST_CASE("TileTemplate: what is missing or unknown is named") {
  const auto fault = [](const char* text) { return TileTemplate::parse(text, {}).error().message; };
  CHECK(fault("http://h/{z}/{x}.png").find("{y}") != std::string::npos);
  CHECK(fault("http://h/{z}/{x}/{y}/{time}").find("{time}") != std::string::npos);
  CHECK(fault("http://h/{z}/{x}/{y").find("{y}") != std::string::npos);
  // What follows an open brace may hold a key.
  for (const char* open : {"http://h/{z}/{x}/{y?key=sesame", "http://h/{z}/{x}/{y.png?key=sesame&a={z}", "http://h/{z}/{x}/{y/sesame"}) {
    CHECK(fault(open).find("{y}") != std::string::npos);
    CHECK(fault(open).find("sesame") == std::string::npos);
  }
  CHECK(fault("http://{s}/{z}/{x}/{y}").find("subdomains") != std::string::npos);
  CHECK(fault("").find("{z}") != std::string::npos);
}
