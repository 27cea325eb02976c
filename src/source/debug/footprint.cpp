#include "source/debug/footprint.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "source/drawn_source.h"

namespace tellurion::source {
namespace {

constexpr int kFullWidth = 1 << 15;  ///< pixels of level 0: a kilometre each on Earth
constexpr Ink kTint{64, 48, 0, 80};
constexpr Ink kLine{255, 200, 0, 255};
constexpr double kSmall = 0.05;      ///< radians from the middle to a border that a ring makes seen
constexpr double kRing = 0.08;       ///< its radius
constexpr double kLinePixels = 2.5;

class FootprintDrawing {
 public:
  FootprintDrawing(std::shared_ptr<const RasterSource> raster, const geo::Ellipsoid& world)
      : raster_(std::move(raster)), middle_(geo::normal_at(middle_of(*raster_))) {
    const LevelSize& size = raster_->description().levels.front();
    is_small_ = std::max(size.width, size.height) * raster_->description().spacing.value / 2.0 < kSmall * world.a();
  }

  raster::Image draw(const LevelSize& level, const PixelWindow& window) const {
    // One pixel more on every side tells where the border runs.
    const int width = window.width + 2, height = window.height + 2;
    const double step = 2.0 * std::numbers::pi / level.width;
    std::vector<geo::LatLon> places;
    places.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = -1; y <= window.height; ++y) {
      const double latitude = std::numbers::pi / 2 - (window.y + y + 0.5) * step;
      for (int x = -1; x <= window.width; ++x) {
        places.push_back({Radians(std::clamp(latitude, -std::numbers::pi / 2, std::numbers::pi / 2)),
                          Radians(std::remainder((window.x + x + 0.5) * step - std::numbers::pi, 2.0 * std::numbers::pi))});
      }
    }
    const std::vector<bool> within = are_within(places);
    raster::Image image{window.width, window.height, {}};
    image.rgba.reserve(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * 4);
    for (int y = 0; y < window.height; ++y) {
      for (int x = 0; x < window.width; ++x) {
        const auto at = [&](int column, int row) { return static_cast<std::size_t>((row + 1) * width + column + 1); };
        const bool here = within[at(x, y)];
        const bool is_border = here != within[at(x - 1, y)] || here != within[at(x + 1, y)] || here != within[at(x, y - 1)] || here != within[at(x, y + 1)];
        const Ink& ink = is_border || is_on_ring(places[at(x, y)], step) ? kLine : here ? kTint : kNoInk;
        image.rgba.insert(image.rgba.end(), ink.begin(), ink.end());
      }
    }
    return image;
  }

 private:
  /// Whether each lies on the raster's ground.
  std::vector<bool> are_within(const std::vector<geo::LatLon>& places) const {
    std::vector<bool> within(places.size(), false);
    const Result<std::unique_ptr<RasterReader>> reader = raster_->open_reader();
    if (!reader) return within;
    std::vector<glm::dvec2> pixels(places.size());
    (*reader)->to_pixels(places, pixels);
    const LevelSize& size = raster_->description().levels.front();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      within[i] = pixels[i].x >= 0.0 && pixels[i].y >= 0.0 && pixels[i].x <= size.width && pixels[i].y <= size.height;
    }
    return within;
  }

  bool is_on_ring(const geo::LatLon& place, double step) const {
    if (!is_small_) return false;
    const double angle = std::acos(std::clamp(glm::dot(geo::normal_at(place).xyz, middle_.xyz), -1.0, 1.0));
    return std::abs(angle - kRing) < std::max(kLinePixels / 2.0 * step, kRing / 40.0);
  }

  std::shared_ptr<const RasterSource> raster_;
  geo::Vector<geo::Ecef> middle_;
  bool is_small_ = false;
};

}  // namespace

geo::LatLon middle_of(const RasterSource& raster) {
  const RasterDescription& about = raster.description();
  geo::LatLon place{Radians(NAN), Radians(NAN)};
  if (const auto reader = raster.open_reader()) {
    const glm::dvec2 middle = 0.5 * glm::dvec2(about.levels.front().width, about.levels.front().height);
    (*reader)->to_places({&middle, 1}, {&place, 1});
  }
  if (std::isfinite(place.latitude.value) && std::isfinite(place.longitude.value)) return place;
  return {Radians(0.5 * (about.bounds.south.value + about.bounds.north.value)), Radians(0.5 * (about.bounds.west.value + about.bounds.east.value))};
}

Result<std::unique_ptr<RasterSource>> open_footprint(std::shared_ptr<const RasterSource> raster, const geo::Ellipsoid& world) {
  Drawing drawing;
  drawing.name = fmt::format("footprint of {}", raster->description().name);
  drawing.levels = halved_levels({kFullWidth, kFullWidth / 2});
  const double pixel = 360.0 / kFullWidth;
  drawing.georeference = {geographic_crs(world), {-180.0, pixel, 0.0, 90.0, 0.0, -pixel}, kFullWidth, kFullWidth / 2};
  drawing.draw = [drawn = FootprintDrawing(std::move(raster), world), levels = drawing.levels](int level, const PixelWindow& window) {
    return drawn.draw(levels[static_cast<std::size_t>(level)], window);
  };
  return open_drawing(std::move(drawing), world);
}

}  // namespace tellurion::source
