// GeoTIFFs on a server agree with the same files read from disk, and each of their bytes is fetched once.
#include <algorithm>
#include <array>
#include <atomic>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "fetch/little_server.h"
#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"
#include "source/statistics.h"

using namespace tellurion;
using namespace tellurion::source;
using test::Ask;
using test::LittleServer;
using test::MadeFile;
using test::MadeRaster;
using test::Say;
using namespace std::chrono_literals;

namespace {

/// The bytes of a file, as GDAL sees it.
std::string bytes_of(const std::string& path) {
  VSILFILE* file = VSIFOpenL(path.c_str(), "rb");
  REQUIRE(file != nullptr);
  VSIFSeekL(file, 0, SEEK_END);
  std::string bytes(static_cast<std::size_t>(VSIFTellL(file)), '\0');
  VSIFSeekL(file, 0, SEEK_SET);
  CHECK(VSIFReadL(bytes.data(), 1, bytes.size(), file) == bytes.size());
  VSIFCloseL(file);
  return bytes;
}

/// Serves one file in parts and remembers them.
class RangeServer {
 public:
  explicit RangeServer(std::string file)
      : file_(std::move(file)), server_([this](const Ask& ask) {
          const std::size_t at = ask.headers.find("Range: bytes=");
          for (int i = 0; holds_ && i < 20'000; ++i) std::this_thread::sleep_for(1ms);
          const Say say = test::part_of(file_, ask, "\"1\"");
          std::lock_guard lock(mutex_);
          if (at == std::string::npos) return say;
          const std::string range = ask.headers.substr(at + 13, ask.headers.find('\r', at) - at - 13);
          parts_.emplace_back(std::stoull(range), say.body.size());
          if (broken_ && parts_.back().first > 0) return Say{.status = 503};
          if (garbles_ && parts_.back().first > 0) return Say{.status = 206, .body = std::string(say.body.size(), 'x'), .headers = say.headers};
          return say;
        }) {}

  std::string url() const { return server_.url("/raster.tif?key=secret"); }
  std::vector<std::pair<std::uint64_t, std::uint64_t>> parts() const {
    std::lock_guard lock(mutex_);
    return parts_;
  }
  /// Bytes of the file that were sent more than once, but for the chunks of 64 KB in which directories come.
  std::uint64_t sent_twice() const {
    auto sorted = parts();
    std::erase_if(sorted, [](const auto& part) { return part.first % 65536 == 0; });
    std::sort(sorted.begin(), sorted.end());
    std::uint64_t end = 0, twice = 0;
    for (const auto& [offset, length] : sorted) {
      if (offset < end) twice += std::min(end, offset + length) - offset;
      end = std::max(end, offset + length);
    }
    return twice;
  }
  std::atomic<bool> broken_{false}, garbles_{false}, holds_{false};

 private:
  std::string file_;
  mutable std::mutex mutex_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> parts_;
  LittleServer server_;
};

std::shared_ptr<fetch::ByteStore> store() {
  fetch::StoreOptions options;
  options.fetch.first_pause = 5ms;
  options.fetch.most_attempts = 2;
  options.pause_after_failure = 10ms;
  return std::make_shared<fetch::ByteStore>(options);
}

template <class Read>
auto settled(RasterReader& reader, int& rounds, const Read& read) {
  for (;;) {
    auto data = read();
    if (data || data.error().code != ErrorCode::pending) return data;
    ++rounds;
    const auto awaited = reader.take_awaited();
    CHECK_FALSE(awaited.empty());
    for (const auto& arrival : awaited) REQUIRE(arrival->wait_for(20s));
  }
}

/// Every level of the remote raster, window by window, equals the local one.
void compare(const std::string& path, SampleKind kind, const geo::Ellipsoid& world) {
  CAPTURE(path);
  GdalOptions options;
  options.path = path;
  options.kind = kind;
  options.vertical = "ellipsoid";
  const auto local = open_gdal(options, world);
  REQUIRE_MESSAGE(local, (local ? "" : local.error().message));
  const RangeServer server(bytes_of(path));
  options.path = server.url();
  const auto remote = open_cog(options, {}, world, store());
  REQUIRE_MESSAGE(remote, (remote ? "" : remote.error().message));
  const RasterDescription& about = (*remote)->description();
  CHECK(about.is_remote);
  CHECK(about.name.find("secret") == std::string::npos);
  CHECK((*remote)->revision().find("secret") == std::string::npos);
  REQUIRE(about.levels.size() == (*local)->description().levels.size());
  const std::size_t opening = server.parts().size();
  auto near = (*local)->open_reader(), far = (*remote)->open_reader();
  REQUIRE(near);
  REQUIRE(far);
  CHECK_MESSAGE(server.parts().size() == opening, "a reader needs nothing more than the source");
  int rounds = 0;
  for (std::size_t level = about.levels.size(); level-- > 0;) {
    constexpr int kSide = 256;
    const auto [width, height] = about.levels[level];
    for (int y = 0; y < height; y += kSide) {
      for (int x = 0; x < width; x += kSide) {
        const PixelWindow window{x, y, std::min(kSide, width - x), std::min(kSide, height - y)};
        const int at = static_cast<int>(level);
        if (kind == SampleKind::height) {
          const auto a = (*near)->read_heights(at, window), b = settled(**far, rounds, [&] { return (*far)->read_heights(at, window); });
          REQUIRE(a);
          REQUIRE_MESSAGE(b, (b ? "" : b.error().message));
          CHECK(std::equal(a->metres.begin(), a->metres.end(), b->metres.begin(), b->metres.end(), [](float p, float q) { return p == q || (std::isnan(p) && std::isnan(q)); }));
        } else {
          const auto a = (*near)->read_colours(at, window), b = settled(**far, rounds, [&] { return (*far)->read_colours(at, window); });
          REQUIRE(a);
          REQUIRE_MESSAGE(b, (b ? "" : b.error().message));
          CHECK(a->rgba == b->rgba);
        }
      }
    }
  }
  CHECK(rounds > 0);
  CHECK(server.sent_twice() == 0);
  auto parts = server.parts();
  std::sort(parts.begin(), parts.end());
  CHECK(std::adjacent_find(parts.begin(), parts.end()) == parts.end());
  for (const auto& [offset, length] : server.parts()) CHECK(length > 0);
}

MadeRaster large_raster(std::vector<std::string> options, int bands = 1) {
  MadeRaster raster;
  raster.width = 700;
  raster.height = 600;
  raster.type = bands == 1 ? GDT_Int16 : GDT_Byte;
  raster.transform = std::array<double, 6>{10, 0.001, 0, 50, 0, -0.001};
  for (int band = 0; band < bands; ++band) {
    std::vector<double> samples;
    unsigned state = 7u + static_cast<unsigned>(band);
    for (int i = 0; i < raster.width * raster.height; ++i) {
      state = state * 1664525u + 1013904223u;
      samples.push_back(bands == 1 ? 1000 + static_cast<double>(state >> 24) : static_cast<double>(state >> 24));
    }
    raster.values.push_back(std::move(samples));
  }
  raster.creation_options = std::move(options);
  raster.adjust = [](GDALDataset& dataset) {
    std::array<int, 2> factors{2, 4};
    REQUIRE(dataset.BuildOverviews("AVERAGE", 2, factors.data(), 0, nullptr, nullptr, nullptr) == CE_None);
  };
  return raster;
}

}  // namespace

TEST_CASE("open_cog: tiled, striped, by band or by pixel, the samples are those of the file") {
  compare(MadeFile("cog_tiled.tif", large_raster({"TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128", "COMPRESS=DEFLATE"})).path(), SampleKind::height, geo::kWgs84);
  compare(MadeFile("cog_strips.tif", large_raster({"BLOCKYSIZE=1"})).path(), SampleKind::height, geo::kWgs84);
  compare(MadeFile("cog_bands.tif", large_raster({"TILED=YES", "INTERLEAVE=BAND"}, 3)).path(), SampleKind::colour, geo::kWgs84);
  compare(MadeFile("cog_pixels.tif", large_raster({"TILED=YES", "INTERLEAVE=PIXEL", "COMPRESS=LZW"}, 4)).path(), SampleKind::colour, geo::kWgs84);
}

TEST_CASE("open_cog: real files") {
  if (const auto path = test::shared_data("earth/regional/cog_int16_utm21n.tif")) {
    compare(*path, SampleKind::height, geo::kWgs84);
    compare(*path, SampleKind::grey, geo::kWgs84);
  }
  if (const auto path = test::shared_data("earth/regional/mosaic_cog1.tif")) compare(*path, SampleKind::colour, geo::kWgs84);
  if (const auto path = test::shared_data("mars/cog_hirise_mars.tif")) compare(*path, SampleKind::colour, geo::Ellipsoid(Metres(3396190.0), Metres(3396190.0)));
}

TEST_CASE("open_cog: no read waits, neither for blocks nor for where they lie") {
  MadeRaster raster = large_raster({"TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=16", "BIGTIFF=YES"});
  raster.width = raster.height = 2048;  // 16,384 blocks: some 200 KB say where they are
  raster.values = {test::ramp(2048 * 2048, -20'000, 1.0 / 128)};
  const MadeFile file("cog_index.tif", raster);
  RangeServer server(bytes_of(file.path()));
  GdalOptions options;
  options.path = server.url();
  options.vertical = "ellipsoid";
  const auto source = open_cog(options, {}, geo::kWgs84, store());
  REQUIRE(source);
  auto reader = (*source)->open_reader();
  REQUIRE(reader);
  const PixelWindow window{1200, 1200, 48, 48};
  int rounds = 0;
  for (bool done = false; !done; ++rounds) {
    server.holds_ = true;
    const auto read = (*reader)->read_heights(0, window);  // a reader that waited would get its bytes after 20 s only
    server.holds_ = false;
    done = read.has_value();
    if (done) {
      CHECK(read->at(0, 0) == static_cast<float>(std::round(raster.values[0][1200 * 2048 + 1200])));
      break;
    }
    REQUIRE(read.error().code == ErrorCode::pending);
    const auto awaited = (*reader)->take_awaited();
    REQUIRE_FALSE(awaited.empty());
    for (const auto& arrival : awaited) REQUIRE(arrival->wait_for(20s));
  }
  CHECK_MESSAGE(rounds >= 2, "the index and then the blocks");
  CHECK(rounds <= 5);
  CHECK(server.sent_twice() == 0);
}

TEST_CASE("open_cog: a part that cannot be had is an error, and is there once the server is well again") {
  const MadeFile file("cog_broken.tif", large_raster({"TILED=YES"}));
  RangeServer server(bytes_of(file.path()));
  GdalOptions options;
  options.path = server.url();
  options.vertical = "ellipsoid";
  const auto source = open_cog(options, {}, geo::kWgs84, store());
  REQUIRE(source);
  auto reader = (*source)->open_reader();
  REQUIRE(reader);
  const PixelWindow window{256, 256, 256, 256};
  int rounds = 0;
  server.broken_ = true;
  const auto failed = settled(**reader, rounds, [&] { return (*reader)->read_heights(0, window); });
  REQUIRE_FALSE(failed);
  CHECK(failed.error().code == ErrorCode::unavailable);
  CHECK(failed.error().message.find("secret") == std::string::npos);
  std::this_thread::sleep_for(30ms);
  server.broken_ = false;
  const auto well = settled(**reader, rounds, [&] { return (*reader)->read_heights(0, window); });
  REQUIRE(well);
  CHECK(well->at(0, 0) == static_cast<float>(large_raster({}).values[0][256 * 700 + 256]));
}

TEST_CASE("statistics_of: of a remote file as of the same on disk, of a level of a million samples at most; a server without an answer is told of") {
  MadeRaster raster = large_raster({"TILED=YES"});
  raster.width = 1400;
  raster.height = 1200;
  raster.values = {test::ramp(1400 * 1200, -4000, 1.0 / 128)};
  const MadeFile file("cog_statistics.tif", raster);
  RangeServer server(bytes_of(file.path()));
  GdalOptions options;
  options.path = file.path();
  options.vertical = "ellipsoid";
  const auto local = open_gdal(options, geo::kWgs84);
  REQUIRE(local);
  options.path = server.url();
  const auto remote = open_cog(options, {}, geo::kWgs84, store());
  REQUIRE(remote);
  const auto wanted = statistics_of(**local, kMostRemoteSamples), found = statistics_of(**remote, 1e9);
  REQUIRE(wanted);
  REQUIRE_MESSAGE(found, (found ? "" : found.error().message));
  CHECK(wanted->level == 1);
  CHECK(found->level == 1);
  CHECK(found->share_there == wanted->share_there);
  CHECK(found->bands[0].mean == wanted->bands[0].mean);
  CHECK(found->bands[0].deviation == wanted->bands[0].deviation);
  const auto again = open_cog(options, {}, geo::kWgs84, store());
  REQUIRE(again);
  server.broken_ = true;
  const auto failed = statistics_of(**again, 1e9);
  REQUIRE_FALSE(failed);
  CHECK(failed.error().code == ErrorCode::unavailable);
}

TEST_CASE("open_cog: what proves damaged is not kept") {
  const MadeFile file("cog_garbled.tif", large_raster({"TILED=YES", "COMPRESS=DEFLATE"}));
  RangeServer server(bytes_of(file.path()));
  GdalOptions options;
  options.path = server.url();
  options.vertical = "ellipsoid";
  const auto source = open_cog(options, {}, geo::kWgs84, store());
  REQUIRE(source);
  auto reader = (*source)->open_reader();
  const PixelWindow window{256, 256, 256, 256};
  int rounds = 0;
  server.garbles_ = true;
  const auto failed = settled(**reader, rounds, [&] { return (*reader)->read_heights(0, window); });
  REQUIRE_FALSE(failed);
  CHECK(failed.error().code == ErrorCode::corrupt);
  std::this_thread::sleep_for(30ms);
  server.garbles_ = false;
  CHECK(settled(**reader, rounds, [&] { return (*reader)->read_heights(0, window); }));
}

TEST_CASE("open_cog: what is not there or no GeoTIFF is said") {
  const std::string text(100'000, 'x');
  const LittleServer server([&](const Ask& ask) {
    if (ask.path == "/text.tif") return test::part_of(text, ask);
    if (ask.path == "/whole.tif") return Say{.body = text};
    return Say{.status = 404};
  });
  const auto code = [&](const std::string& path) {
    GdalOptions options;
    options.path = server.url(path);
    const auto opened = open_cog(options, {}, geo::kWgs84, store());
    REQUIRE_FALSE(opened);
    CHECK(opened.error().message.find("vsitellurion") == std::string::npos);
    CHECK(opened.error().message.find("127.0.0.1") != std::string::npos);
    return opened.error().code;
  };
  CHECK(code("/none.tif") == ErrorCode::not_found);
  CHECK(code("/text.tif") == ErrorCode::unsupported);
  CHECK(code("/whole.tif") == ErrorCode::unsupported);
  const MadeFile file("cog_cut.tif", large_raster({"TILED=YES"}));
  std::string bytes = bytes_of(file.path());
  const LittleServer cut([&](const Ask& ask) { return test::part_of(bytes.substr(0, 300'000), ask); });
  GdalOptions options;
  options.path = cut.url("/cut.tif");
  options.vertical = "ellipsoid";
  const auto source = open_cog(options, {}, geo::kWgs84, store());
  if (source) {
    auto reader = (*source)->open_reader();
    REQUIRE(reader);
    int rounds = 0;
    const auto read = settled(**reader, rounds, [&] { return (*reader)->read_heights(0, {512, 512, 188, 88}); });
    REQUIRE_FALSE(read);
    CHECK(read.error().message.find("cut off") != std::string::npos);
  } else {
    CHECK_FALSE(source.error().message.empty());
  }
}
