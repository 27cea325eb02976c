#include "cache/cached_raster.h"

#include <cmath>
#include <limits>
#include <random>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::cache;

namespace {

/// A raster of 700 x 300 samples made by a formula, with one void; level 1 holds every height plus 10,000.
class FormulaSource final : public source::RasterSource, source::Coverage {
 public:
  explicit FormulaSource(bool wraps) {
    about_.levels = {{700, 300}, {350, 150}};
    about_.wraps = wraps;
  }
  static float height(int level, int x, int y) {
    if (level == 0 && x == 100 && y == 50) return raster::kNoHeight;
    return static_cast<float>((x * 7919 + y * 104729) % 1000 + level * 10000);
  }
  /// Blocks of level 0 are on their way until then.
  bool arrived = true;
  mutable int asked = 0;

  static std::array<std::uint8_t, 4> colour(int x, int y) {
    return {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(x >> 8), static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(y >> 8)};
  }

  const source::RasterDescription& description() const override { return about_; }
  const Coverage& coverage() const override { return *this; }
  std::string revision() const override { return "formula"; }
  bool touches(const geo::TileKey&) const override { return true; }
  Metres spacing_under(const geo::TileKey&) const override { return Metres(1.0); }
  Result<std::unique_ptr<source::RasterReader>> open_reader() const override { return std::unique_ptr<source::RasterReader>(new Reader(*this)); }

 private:
  struct Reader final : source::RasterReader {
    explicit Reader(const FormulaSource& s) : source(s) {}

    Error on_its_way() {
      ++source.asked;
      awaited.push_back(std::make_shared<fetch::Arrival>());
      return {ErrorCode::pending, "formula"};
    }
    source::Awaited take_awaited() override { return std::exchange(awaited, {}); }
    Result<raster::HeightGrid> read_heights(int level, const source::PixelWindow& w) override {
      if (!source.arrived) return on_its_way();
      raster::HeightGrid grid{w.width, w.height, {}};
      for (int y = w.y; y < w.y + w.height; ++y) {
        for (int x = w.x; x < w.x + w.width; ++x) grid.metres.push_back(height(level, x, y));
      }
      return grid;
    }
    Result<raster::Image> read_colours(int, const source::PixelWindow& w) override {
      if (!source.arrived) return on_its_way();
      raster::Image image{w.width, w.height, {}};
      for (int y = w.y; y < w.y + w.height; ++y) {
        for (int x = w.x; x < w.x + w.width; ++x) {
          const auto c = colour(x, y);
          image.rgba.insert(image.rgba.end(), c.begin(), c.end());
        }
      }
      return image;
    }
    void to_pixels(std::span<const geo::LatLon>, std::span<glm::dvec2>) override {}
    void to_places(std::span<const glm::dvec2>, std::span<geo::LatLon>) override {}

    const FormulaSource& source;
    source::Awaited awaited;
  };
  source::RasterDescription about_;
};

/// The rule of cached_raster.h, written down plainly.
HeightSample expected(int level, glm::dvec2 pixel, bool wraps) {
  const int width = level == 0 ? 700 : 350;
  const int height = level == 0 ? 300 : 150;
  if (level == 1) pixel = pixel * 0.5;
  const auto reach = [](double x, double size) { return std::clamp(1.0 - std::max(-x, x - size), 0.0, 1.0); };
  const double around = reach(pixel.y, height) * (wraps ? 1.0 : reach(pixel.x, width));
  double sum = 0;
  double valid = 0;
  const int left = static_cast<int>(std::floor(pixel.x - 0.5));
  const int top = static_cast<int>(std::floor(pixel.y - 0.5));
  for (int y = top; y <= top + 1; ++y) {
    for (int x = left; x <= left + 1; ++x) {
      const double weight = (1 - std::abs(pixel.x - 0.5 - x)) * (1 - std::abs(pixel.y - 0.5 - y));
      const int column = wraps ? (x + width) % width : std::clamp(x, 0, width - 1);
      const float h = FormulaSource::height(level, column, std::clamp(y, 0, height - 1));
      if (std::isnan(h)) continue;
      sum += weight * static_cast<double>(h);
      valid += weight;
    }
  }
  return around > 0 && valid > 0 ? HeightSample{sum / valid, valid * around} : HeightSample{};
}

void check_points(bool wraps, int level, const std::vector<glm::dvec2>& pixels) {
  const FormulaSource source(wraps);
  BlockCache cache(1 << 20);
  Result<CachedRaster> raster = CachedRaster::open(source, cache, 1);
  REQUIRE(raster);
  std::vector<HeightSample> heights(pixels.size());
  REQUIRE(raster->sample_heights(level, pixels, heights));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    CAPTURE(pixels[i].x);
    CAPTURE(pixels[i].y);
    const HeightSample wanted = expected(level, pixels[i], wraps);
    REQUIRE(heights[i].coverage == doctest::Approx(wanted.coverage).epsilon(1e-9));
    REQUIRE(heights[i].metres == doctest::Approx(wanted.metres).epsilon(1e-9));
    HeightSample alone;  // without what came before
    REQUIRE(raster->sample_heights(level, {&pixels[i], 1}, {&alone, 1}));
    REQUIRE(alone.metres == heights[i].metres);
  }
}

}  // namespace

TEST_CASE("sample_heights: random points in, at and beyond the raster follow the bilinear rule, wrapping or not") {
  const unsigned seed = std::random_device{}();
  MESSAGE("seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(-2.0, 702.0);
  std::uniform_real_distribution<double> y(-2.0, 302.0);
  std::uniform_real_distribution<double> inside(0.0, 700.0);
  std::vector<glm::dvec2> pixels;
  for (int i = 0; i < 3000; ++i) pixels.push_back({x(random), y(random)});
  check_points(false, 0, pixels);
  for (glm::dvec2& pixel : pixels) pixel.x = inside(random);
  check_points(true, 0, pixels);
  check_points(true, 1, pixels);
}

TEST_CASE("sample_heights: points round block borders, raster borders and a void follow the bilinear rule") {
  std::vector<glm::dvec2> pixels;
  for (const double x : {-1.0, -0.4, 0.0, 0.5, 255.5, 256.0, 256.5, 511.7, 512.0, 699.5, 699.9, 700.0, 700.6, 701.0, 100.5, 100.9, 101.49}) {
    for (const double y : {-0.7, 0.0, 0.2, 50.1, 50.5, 51.4, 255.6, 256.0, 256.3, 299.5, 300.0, 300.8}) pixels.push_back({x, y});
  }
  check_points(false, 0, pixels);
  check_points(false, 1, pixels);
  std::erase_if(pixels, [](const glm::dvec2& p) { return p.x < 0 || p.x >= 700; });
  check_points(true, 0, pixels);
}

TEST_CASE("sample_heights: coverage falls to nothing across the cell beside a void and across one pixel beyond the border") {
  const FormulaSource source(false);
  BlockCache cache(1 << 20);
  CachedRaster raster = CachedRaster::open(source, cache, 1).value();
  const std::vector<glm::dvec2> pixels{{100.5, 50.5}, {100.75, 50.5}, {101.5, 50.5}, {-0.25, 20.5}, {-1.0, 20.5}, {350.0, 300.5}};
  std::vector<HeightSample> heights(pixels.size());
  REQUIRE(raster.sample_heights(0, pixels, heights));
  const std::array<double, 6> coverage{0.0, 0.25, 1.0, 0.75, 0.0, 0.5};
  for (std::size_t i = 0; i < pixels.size(); ++i) CHECK(heights[i].coverage == doctest::Approx(coverage[i]));
  CHECK(heights[1].metres == FormulaSource::height(0, 101, 50));
  CHECK(heights[3].metres == FormulaSource::height(0, 0, 20));
}

TEST_CASE("sample_heights: pixels that are no numbers, or absurdly far, have no coverage") {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const bool wraps : {false, true}) {
    const FormulaSource source(wraps);
    BlockCache cache(1 << 20);
    CachedRaster raster = CachedRaster::open(source, cache, 1).value();
    const std::vector<glm::dvec2> pixels{{kNaN, 5}, {5, kNaN}, {kInfinity, 5}, {5, -kInfinity}, {1e300, 5}, {5, 1e300}};
    std::vector<HeightSample> heights(pixels.size(), HeightSample{1, 1});
    REQUIRE(raster.sample_heights(0, pixels, heights));
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      CAPTURE(i);
      CHECK(heights[i].coverage == 0.0);
      CHECK(raster.nearest_height(pixels[i]).value().coverage == 0.0);
    }
  }
}

TEST_CASE("nearest_height: gives the sample whose pixel holds the point") {
  const FormulaSource source(false);
  BlockCache cache(1 << 20);
  CachedRaster raster = CachedRaster::open(source, cache, 1).value();
  CHECK(raster.nearest_height({255.99, 0.0}).value().metres == FormulaSource::height(0, 255, 0));
  CHECK(raster.nearest_height({256.0, 0.0}).value().metres == FormulaSource::height(0, 256, 0));
  CHECK(raster.nearest_height({100.3, 50.9}).value().coverage == 0.0);
  CHECK(raster.nearest_height({700.0, 0.0}).value().coverage == 0.0);
  CHECK(raster.nearest_height({-0.01, 0.0}).value().coverage == 0.0);
}

TEST_CASE("read_colours: windows over block borders are seamless, and beyond the raster repeat its border or wrap round") {
  for (const bool wraps : {false, true}) {
    const FormulaSource source(wraps);
    BlockCache cache(1 << 20);
    CachedRaster raster = CachedRaster::open(source, cache, 1).value();
    const source::PixelWindow window{-20, 240, 760, 80};
    const raster::Image image = raster.read_colours(0, window).value();
    for (int j = 0; j < window.height; ++j) {
      for (int i = 0; i < window.width; ++i) {
        const int x = window.x + i;
        const int column = wraps ? (x + 700) % 700 : std::clamp(x, 0, 699);
        REQUIRE(image.at(i, j) == FormulaSource::colour(column, std::min(window.y + j, 299)));
      }
    }
  }
}

TEST_CASE("sample_heights: a cache without any room still gives right answers") {
  const FormulaSource source(false);
  BlockCache cache(0);
  CachedRaster raster = CachedRaster::open(source, cache, 1).value();
  for (int i = 0; i < 700; ++i) CHECK(raster.nearest_height({i + 0.5, (i % 300) + 0.5}).value().metres == FormulaSource::height(0, i, i % 300));
}

TEST_CASE("CachedRaster: what is on its way is asked for all at once, and read when it is there") {
  FormulaSource source(false);
  source.arrived = false;
  BlockCache cache(std::size_t{16} << 20);
  CachedRaster raster = std::move(CachedRaster::open(source, cache, 3)).value();
  // The corner of four blocks, and one more.
  const std::vector<glm::dvec2> pixels{{256.0, 256.0}, {10.0, 10.0}, {600.0, 20.0}};
  std::vector<HeightSample> heights(pixels.size());
  REQUIRE(raster.sample_heights(0, pixels, heights));
  for (const HeightSample& height : heights) CHECK(height.coverage == 1.0);  // so that nothing below is asked for meanwhile
  CHECK(source.asked == 5);
  source::Awaited awaited;
  CHECK(raster.take_pending(awaited));
  CHECK(awaited.size() == 5);
  CHECK_FALSE(raster.take_pending(awaited));

  const auto image = raster.read_colours(0, {200, 200, 100, 100});
  REQUIRE_FALSE(image);
  CHECK(image.error().code == ErrorCode::pending);
  awaited.clear();
  CHECK(raster.take_pending(awaited));
  CHECK(awaited.size() == 4);
  CHECK(cache.reads_of(3).errors == 0);

  source.arrived = true;
  REQUIRE(raster.sample_heights(0, pixels, heights));
  CHECK_FALSE(raster.take_pending(awaited));
  for (std::size_t i = 0; i < pixels.size(); ++i) CHECK(heights[i].metres == doctest::Approx(expected(0, pixels[i], false).metres));
  CHECK(raster.read_colours(0, {200, 200, 100, 100}));
}
