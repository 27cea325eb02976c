#include "prepare/open_sea.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace tellurion::prepare {
namespace {

constexpr int kLargestBlock = 64;
constexpr double kLargestRadius = 0.1;  ///< of the body's: larger blocks may bend too much for their corners to bound them
constexpr double kSlack = 1.05;         ///< of a block's radius

/// The straight line under a way of `metres` over a body.
double chord(const geo::Ellipsoid& body, double metres) { return 2.0 * body.a() * std::sin(std::min(metres / (2.0 * body.a()), std::numbers::pi / 2.0)); }

class Finder {
 public:
  Finder(const Shore& shore, const PlaceOfPixel& place, const PixelBox& box, double metres)
      : shore_(shore), place_(place), box_(box), limit_(chord(shore.body(), metres)), found_(static_cast<std::size_t>(box.width) * static_cast<std::size_t>(box.height), 0) {}

  std::vector<std::uint8_t> find() {
    for (int y = 0; y < box_.height; y += kLargestBlock) {
      for (int x = 0; x < box_.width; x += kLargestBlock) look_at({x, y, std::min(kLargestBlock, box_.width - x), std::min(kLargestBlock, box_.height - y)});
    }
    return std::move(found_);
  }

 private:
  void look_at(const PixelBox& block) {
    const auto centre = place_(box_.x + block.x + 0.5 * block.width, box_.y + block.y + 0.5 * block.height);
    const bool is_pixel = block.width == 1 && block.height == 1;
    if (!centre) return is_pixel ? void() : split(block);
    const auto point = point_of(*centre);
    const std::optional<double> radius = is_pixel ? 0.0 : radius_of(block, point);
    if (!radius) return split(block);
    const double distance = shore_.distance(point, limit_ + *radius + 1.0);
    if (distance + *radius <= limit_) return;
    if (distance - *radius <= limit_ && !is_pixel) return split(block);
    if (distance > limit_ && !shore_.is_land(*centre)) mark(block);
  }

  void split(const PixelBox& block) {
    const int width = (block.width + 1) / 2, height = (block.height + 1) / 2;
    for (const int y : {0, height}) {
      for (const int x : {0, width}) {
        const PixelBox part{block.x + x, block.y + y, x == 0 ? width : block.width - width, y == 0 ? height : block.height - height};
        if (part.width > 0 && part.height > 0) look_at(part);
      }
    }
  }

  void mark(const PixelBox& block) {
    for (int y = block.y; y < block.y + block.height; ++y) {
      const auto first = found_.begin() + static_cast<std::ptrdiff_t>(y) * box_.width + block.x;
      std::fill(first, first + block.width, std::uint8_t{1});
    }
  }

  geo::Point<geo::Ecef> point_of(const geo::LatLon& place) const { return geo::surface_point(shore_.body(), geo::normal_at(place)); }

  /// Metres from the centre to the farthest of corners and middles of edges; nothing where these bound nothing.
  std::optional<double> radius_of(const PixelBox& block, const geo::Point<geo::Ecef>& centre) const {
    double radius = 0.0;
    for (const double v : {0.0, 0.5, 1.0}) {
      for (const double u : {0.0, 0.5, 1.0}) {
        const auto corner = place_(box_.x + block.x + u * block.width, box_.y + block.y + v * block.height);
        if (!corner) return std::nullopt;
        radius = std::max(radius, kSlack * glm::length((point_of(*corner) - centre).xyz));
      }
    }
    if (radius > kLargestRadius * shore_.body().a()) return std::nullopt;
    return radius;
  }

  const Shore& shore_;
  const PlaceOfPixel& place_;
  PixelBox box_;
  double limit_;
  std::vector<std::uint8_t> found_;
};

}  // namespace

std::vector<std::uint8_t> open_sea(const Shore& shore, const PlaceOfPixel& place, const PixelBox& box, double metres) { return Finder(shore, place, box, metres).find(); }

}  // namespace tellurion::prepare
