// Rasters whose samples come from a function, in latitude and longitude, for the tests of what workers build.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "cache/block_cache.h"
#include "source/raster_source.h"
#include "surface/elevation_model.h"
#include "surface/surface_facts.h"

namespace tellurion::surface::testing {

inline constexpr double kPi = std::numbers::pi;

/// A raster of `width` x `height` pixels between bounds (degrees); values by column and row of level 0.
struct MadeRaster {
  int width = 360;
  int height = 180;
  double west = -180, south = -90, east = 180, north = 90;
  std::function<float(int, int)> metres = [](int, int) { return 0.0f; };
  std::function<std::array<std::uint8_t, 4>(int, int)> colour = [](int, int) { return std::array<std::uint8_t, 4>{255, 255, 255, 255}; };
  std::string revision = "1";
  bool broken = false;  ///< its colours cannot be read
  std::shared_ptr<const std::atomic<bool>> server{};  ///< not null: its heights are on one, which is there or not
};

/// Says yes for every tile; the tests' planets are small in number of tiles.
class MadeSource final : public source::RasterSource, public source::Coverage {
 public:
  explicit MadeSource(MadeRaster made) : made_(std::move(made)) {
    about_.name = "made";
    about_.kind = source::SampleKind::height;
    about_.is_remote = made_.server != nullptr;
    for (source::LevelSize size{made_.width, made_.height};; size = {(size.width + 1) / 2, (size.height + 1) / 2}) {
      about_.levels.push_back(size);
      if (size.width <= cache::kBlockSide && size.height <= cache::kBlockSide) break;
    }
    about_.wraps = made_.east - made_.west == 360.0;
    about_.ellipsoid = geo::kWgs84;
    about_.bounds = {radians(made_.south), radians(made_.north), radians(made_.west), radians(made_.east)};
    const double degree = geo::kWgs84.a() * kPi / 180.0;
    about_.spacing = Metres(degree * std::max((made_.north - made_.south) / made_.height, (made_.east - made_.west) / made_.width *
                                              std::cos((made_.north + made_.south) / 2 * kPi / 180.0)));
  }

  const source::RasterDescription& description() const override { return about_; }
  const source::Coverage& coverage() const override { return *this; }
  std::string revision() const override { return made_.revision; }
  Result<std::unique_ptr<source::RasterReader>> open_reader() const override {
    ++readers_opened;
    return std::unique_ptr<source::RasterReader>(std::make_unique<Reader>(*this));
  }
  mutable int readers_opened = 0;

  bool touches(const geo::TileKey& key) const override {
    if (about_.wraps) return true;
    const geo::GeodeticBounds b = geo::geodetic_bounds(key);
    if (b.north < about_.bounds.south || b.south > about_.bounds.north) return false;
    for (const double turn : {-2 * kPi, 0.0, 2 * kPi}) {
      if (b.west.value + turn <= about_.bounds.east.value && b.east.value + turn >= about_.bounds.west.value) return true;
    }
    return false;
  }
  Metres spacing_under(const geo::TileKey& key) const override {
    return touches(key) ? about_.spacing : Metres(std::numeric_limits<double>::infinity());
  }

 private:
  static Radians radians(double degrees) { return to_radians(Degrees(degrees)); }

  class Reader final : public source::RasterReader {
   public:
    explicit Reader(const MadeSource& source) : source_(source), made_(source.made_) {}

    Result<raster::HeightGrid> read_heights(int level, const source::PixelWindow& w) override {
      if (made_.server && !*made_.server) return Error{ErrorCode::unavailable, "made: nobody answers"};
      raster::HeightGrid grid{w.width, w.height, {}};
      for_each(level, w, [&](int x0, int y0, int x1, int y1) {
        double sum = 0;
        int count = 0;
        for (int y = y0; y < y1; ++y) {
          for (int x = x0; x < x1; ++x) {
            const float v = made_.metres(x, y);
            if (std::isnan(v)) continue;
            sum += static_cast<double>(v);
            ++count;
          }
        }
        grid.metres.push_back(count > 0 ? static_cast<float>(sum / count) : raster::kNoHeight);
      });
      return grid;
    }
    Result<raster::Image> read_colours(int level, const source::PixelWindow& w) override {
      if (made_.broken) return Error{ErrorCode::unavailable, "made: broken"};
      raster::Image image{w.width, w.height, {}};
      for_each(level, w, [&](int x0, int y0, int x1, int y1) {
        std::array<int, 4> sum{};
        for (int y = y0; y < y1; ++y) {
          for (int x = x0; x < x1; ++x) {
            const std::array<std::uint8_t, 4> c = made_.colour(x, y);
            for (std::size_t i = 0; i < 4; ++i) sum[i] += c[i];
          }
        }
        for (const int s : sum) image.rgba.push_back(static_cast<std::uint8_t>(s / ((x1 - x0) * (y1 - y0))));
      });
      return image;
    }
    void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) override {
      for (std::size_t i = 0; i < places.size(); ++i) {
        const double middle = (made_.west + made_.east) / 2;
        double lon = places[i].longitude.value * 180.0 / kPi;
        lon -= 360.0 * std::floor((lon - middle) / 360.0 + 0.5);
        pixels[i] = {(lon - made_.west) / (made_.east - made_.west) * made_.width,
                     (made_.north - places[i].latitude.value * 180.0 / kPi) / (made_.north - made_.south) * made_.height};
      }
    }
    void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) override {
      for (std::size_t i = 0; i < places.size(); ++i) {
        places[i] = {radians(made_.north - pixels[i].y / made_.height * (made_.north - made_.south)),
                     radians(made_.west + pixels[i].x / made_.width * (made_.east - made_.west))};
      }
    }

   private:
    /// Calls visit with the pixels of level 0 under every pixel of a window.
    template <class Visit>
    void for_each(int level, const source::PixelWindow& w, Visit&& visit) const {
      const source::LevelSize size = source_.about_.levels[static_cast<std::size_t>(level)];
      const auto edge = [](int i, int of, int full) { return static_cast<int>(static_cast<std::int64_t>(i) * full / of); };
      for (int y = w.y; y < w.y + w.height; ++y) {
        for (int x = w.x; x < w.x + w.width; ++x) {
          visit(edge(x, size.width, made_.width), edge(y, size.height, made_.height), edge(x + 1, size.width, made_.width),
                edge(y + 1, size.height, made_.height));
        }
      }
    }

    const MadeSource& source_;
    const MadeRaster& made_;
  };

  MadeRaster made_;
  source::RasterDescription about_;
};

inline Layer layer_of(MadeRaster made, std::uint32_t id) {
  Layer layer;
  layer.name = "made " + std::to_string(id);
  layer.source = std::make_shared<MadeSource>(std::move(made));
  layer.source_id = id;
  return layer;
}

/// Random heights in [low, high], the same for the same pixel and seed.
inline float noise(int x, int y, std::uint64_t seed, float low, float high) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ull ^ static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4full ^ seed;
  h = (h ^ (h >> 31)) * 0x7fb5d329728ea185ull;
  h = (h ^ (h >> 27)) * 0x81dadef4bc2dd44dull;
  return low + (high - low) * static_cast<float>((h >> 40) & 0xffffff) / 16777215.0f;
}

/// A surface of height layers and a model of it.
struct MadeWorld {
  std::shared_ptr<SurfaceDescription> description = std::make_shared<SurfaceDescription>();
  cache::BlockCache blocks{std::size_t{64} << 20};
  std::optional<ElevationModel> model;

  explicit MadeWorld(std::vector<Layer> heights) {
    description->ellipsoid = geo::kWgs84;
    description->heights = std::move(heights);
    model.emplace(std::move(ElevationModel::open(description, blocks)).value());
  }
};

inline geo::LatLon at(double latitude, double longitude) {
  return {to_radians(Degrees(latitude)), to_radians(Degrees(longitude))};
}

/// The seed of a test's random numbers, printed with every failure below it.
/// Another seed every run; where a commit is checked (CI is set) always the same, for that must not depend on luck.
inline std::uint64_t fresh_seed() {
  if (const char* again = std::getenv("TELLURION_TEST_SEED")) return std::strtoull(again, nullptr, 10);
  return std::getenv("CI") != nullptr ? 20261122u : std::random_device{}();
}

}  // namespace tellurion::surface::testing
