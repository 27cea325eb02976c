#include "source/debug/footprint.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
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

/// The places of a window's pixels with one more on every side, which tells where borders run.
std::vector<geo::LatLon> places_around(const LevelSize& level, const PixelWindow& window) {
  const double step = 2.0 * std::numbers::pi / level.width;
  std::vector<geo::LatLon> places;
  places.reserve(static_cast<std::size_t>(window.width + 2) * static_cast<std::size_t>(window.height + 2));
  for (int y = -1; y <= window.height; ++y) {
    const double latitude = std::numbers::pi / 2 - (window.y + y + 0.5) * step;
    for (int x = -1; x <= window.width; ++x) {
      places.push_back({Radians(std::clamp(latitude, -std::numbers::pi / 2, std::numbers::pi / 2)),
                        Radians(std::remainder((window.x + x + 0.5) * step - std::numbers::pi, 2.0 * std::numbers::pi))});
    }
  }
  return places;
}

/// `here`: for each place of places_around a number that says which rasters lie there, 0: none. `on_ring`: of the places.
template <class OnRing>
raster::Image drawn(const PixelWindow& window, const std::vector<std::uint64_t>& here, const OnRing& on_ring) {
  raster::Image image{window.width, window.height, {}};
  image.rgba.reserve(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * 4);
  const std::size_t stride = static_cast<std::size_t>(window.width) + 2;
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y + 1) * stride + static_cast<std::size_t>(x + 1);
      const bool is_border = here[i] != here[i - 1] || here[i] != here[i + 1] || here[i] != here[i - stride] || here[i] != here[i + stride];
      const Ink& ink = is_border || on_ring(i) ? kLine : here[i] != 0 ? kTint : kNoInk;
      image.rgba.insert(image.rgba.end(), ink.begin(), ink.end());
    }
  }
  return image;
}

class FootprintDrawing {
 public:
  FootprintDrawing(std::shared_ptr<const RasterSource> raster, const geo::Ellipsoid& world)
      : raster_(std::move(raster)), middle_(geo::normal_at(middle_of(*raster_))) {
    const LevelSize& size = raster_->description().levels.front();
    is_small_ = std::max(size.width, size.height) * raster_->description().spacing.value / 2.0 < kSmall * world.a();
  }

  raster::Image draw(const LevelSize& level, const PixelWindow& window) const {
    const std::vector<geo::LatLon> places = places_around(level, window);
    const double step = 2.0 * std::numbers::pi / level.width;
    return drawn(window, are_within(places), [&](std::size_t i) { return is_on_ring(places[i], step); });
  }

 private:
  /// Whether each lies on the raster's ground: 1 or 0.
  std::vector<std::uint64_t> are_within(const std::vector<geo::LatLon>& places) const {
    std::vector<std::uint64_t> within(places.size(), 0);
    const Result<std::unique_ptr<RasterReader>> reader = raster_->open_reader();
    if (!reader) return within;
    std::vector<glm::dvec2> pixels(places.size());
    (*reader)->to_pixels(places, pixels);
    const LevelSize& size = raster_->description().levels.front();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      within[i] = pixels[i].x >= 0.0 && pixels[i].y >= 0.0 && pixels[i].x <= size.width && pixels[i].y <= size.height ? 1 : 0;
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

/// Which rasters of a catalogue touch the ground of a pixel `step` radians wide, as one number.
class CatalogueDrawing {
 public:
  explicit CatalogueDrawing(std::shared_ptr<const Catalogue> catalogue) : catalogue_(std::move(catalogue)) {}

  raster::Image draw(const LevelSize& level, const PixelWindow& window) const {
    const std::vector<geo::LatLon> places = places_around(level, window);
    const double half = 0.5 / (level.width / 8.0);  // of a pixel, in coordinates of a face, whose [-1, 1] are a quarter of a circle
    std::vector<std::uint64_t> here;
    std::vector<std::uint32_t> found;
    here.reserve(places.size());
    for (const geo::LatLon& place : places) {
      const geo::FacePoint point = geo::face_point(geo::normal_at(place));
      catalogue_->find(region_of(point.face, {point.uv - half, point.uv + half}), Radians(0.0), found);
      here.push_back(name_of(found));
    }
    return drawn(window, here, [](std::size_t) { return false; });
  }

 private:
  /// 0 for none, and of different sets hardly ever the same.
  std::uint64_t name_of(const std::vector<std::uint32_t>& found) const {
    std::uint64_t name = 0;
    for (const std::uint32_t i : found) {
      if (catalogue_->sets()[i]->footprint.extent().value < std::numbers::pi) name += (i + 1) * 0x9E3779B97F4A7C15u;
    }
    return name;
  }

  std::shared_ptr<const Catalogue> catalogue_;
};

/// A raster of the whole globe that `draw` fills.
template <class Draws>
Result<std::unique_ptr<RasterSource>> open_over_the_globe(std::string name, Draws draws, const geo::Ellipsoid& world) {
  Drawing drawing;
  drawing.name = std::move(name);
  drawing.levels = halved_levels({kFullWidth, kFullWidth / 2});
  const double pixel = 360.0 / kFullWidth;
  drawing.georeference = {geographic_crs(world), {-180.0, pixel, 0.0, 90.0, 0.0, -pixel}, kFullWidth, kFullWidth / 2};
  drawing.draw = [draws = std::move(draws), levels = drawing.levels](int level, const PixelWindow& window) {
    return draws.draw(levels[static_cast<std::size_t>(level)], window);
  };
  return open_drawing(std::move(drawing), world);
}

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
  std::string name = fmt::format("footprint of {}", raster->description().name);
  return open_over_the_globe(std::move(name), FootprintDrawing(std::move(raster), world), world);
}

Result<std::unique_ptr<RasterSource>> open_footprints(std::shared_ptr<const Catalogue> catalogue, std::string name, const geo::Ellipsoid& world) {
  return open_over_the_globe(fmt::format("footprints of {}", name), CatalogueDrawing(std::move(catalogue)), world);
}

}  // namespace tellurion::source
