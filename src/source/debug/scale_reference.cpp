#include "source/debug/scale_reference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "source/debug/block_letters.h"
#include "source/drawn_source.h"

namespace tellurion::source {
namespace {

constexpr int kFullWidth = 1 << 30;       ///< pixels of level 0: a few centimetres each on Earth
constexpr double kLeastCellPixels = 160;  ///< from one line to the next
constexpr double kHalfPole = std::numbers::pi / 2;

/// Distance from the axis.
double parallel_radius(const geo::Ellipsoid& ellipsoid, double latitude) {
  const double s = std::sin(latitude);
  return ellipsoid.a() * std::cos(latitude) / std::sqrt(1.0 - ellipsoid.e2() * s * s);
}

/// A round size in metres and how it is written.
struct CellSize {
  double metres = 0;
  std::string label;
};

/// The least round size that is not below `least`, but at most `most`.
CellSize round_size(double least, double most, ScaleUnit unit) {
  const double in_metres = unit == ScaleUnit::kilometres ? 1000.0 : 1.0;
  const auto size = [&](int step) {  // steps of 1, 2, 5, 10, ...
    const int decade = static_cast<int>(std::floor(step / 3.0));
    constexpr double kDigits[] = {1.0, 2.0, 5.0};
    return kDigits[step - 3 * decade] * std::pow(10.0, decade);
  };
  int step = 3 * static_cast<int>(std::floor(std::log10(least / in_metres)));
  while (size(step) * in_metres < least) ++step;
  while (size(step) * in_metres > most) --step;
  const int decimals = std::max(-static_cast<int>(std::floor(step / 3.0)), 0);
  return {size(step) * in_metres, fmt::format("{:.{}f} {}", size(step), decimals, unit == ScaleUnit::kilometres ? "km" : "m")};
}

/// What the pixels of a row of the raster have in common.
struct Row {
  double v = 0;            ///< metres above the row of cells' lower edge
  double radius = 0;       ///< of the parallel
  double cell_radius = 0;  ///< of the parallel on which the cells' width is exact
  bool whole = false;      ///< the cells are not cut by a pole
};

class ScaleDrawing {
 public:
  ScaleDrawing(const geo::Ellipsoid& world, ScaleUnit unit) : world_(world), unit_(unit), pole_(meridian_arc(world, Radians(kHalfPole)).value) {}

  raster::Image draw(const LevelSize& level, const PixelWindow& window) const {
    raster::Image image{window.width, window.height, {}};
    image.rgba.resize(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * 4);
    const double angle = 2.0 * std::numbers::pi / level.width;
    const double pixel = angle * world_.a();
    const CellSize cell = round_size(kLeastCellPixels * pixel, pole_, unit_);
    auto out = image.rgba.begin();
    for (int y = window.y; y < window.y + window.height; ++y) {
      const Row row = row_at(std::max(kHalfPole - (y + 0.5) * angle, -kHalfPole), cell.metres);
      for (int x = window.x; x < window.x + window.width; ++x) {
        const Ink ink = ink_at(row, (x + 0.5) * angle - std::numbers::pi, cell, pixel);
        out = std::copy(ink.begin(), ink.end(), out);
      }
    }
    return image;
  }

 private:
  Row row_at(double latitude, double cell) const {
    const double arc = meridian_arc(world_, Radians(latitude)).value;
    const double lower = std::floor(arc / cell) * cell;
    const double middle = 0.5 * (std::max(lower, -pole_) + std::min(lower + cell, pole_));
    return {arc - lower, parallel_radius(world_, latitude), parallel_radius(world_, latitude_of_arc(world_, Metres(middle)).value),
            lower >= -pole_ && lower + cell <= pole_};
  }

  static Ink ink_at(const Row& row, double longitude, const CellSize& cell, double pixel) {
    const double size = cell.metres;
    const double east = row.cell_radius * longitude, end = row.cell_radius * std::numbers::pi;
    const double left = std::floor(east / size) * size;
    const double u = east - left, v = row.v;
    // On the ground a row's pixels are narrower towards the poles; lines are not.
    const double across = row.cell_radius > 0.0 ? row.radius / row.cell_radius : 1.0;
    const double line = std::min({v, size - v, u * across, (size - u) * across, (end - std::abs(east)) * across});
    const double tick = std::min(to_tick(u, v, size) * across, to_tick(v, u, size));
    const double distance = std::min(line, tick);
    if (distance < 0.8 * pixel) return kWhiteInk;
    if (row.whole && left >= -end && left + size <= end) {
      const double letter = size / 72.0;  // half of the cell is text of six letters
      const int column = static_cast<int>(std::floor((u - 0.5 * size) / letter + 0.5 * text_width(cell.label)));
      const int from_top = static_cast<int>(std::floor((0.5 * size - v) / letter + 0.5 * kLetterHeight));
      if (is_inked(cell.label, column, from_top)) return kWhiteInk;
      if (is_inked_nearby(cell.label, column, from_top)) return kBlackInk;
    }
    return distance < 1.8 * pixel ? kBlackInk : kNoInk;
  }

  /// Distance to the nearest tick of an edge: at tenths `along` it, reaching `off` it, the middle one twice as far.
  static double to_tick(double along, double off, double size) {
    const double nearest = std::round(10.0 * along / size);
    const double reach = size / (nearest == 5.0 ? 20.0 : 40.0);
    return off <= reach ? std::abs(along - nearest * size / 10.0) : size;
  }

  geo::Ellipsoid world_;
  ScaleUnit unit_;
  double pole_;  ///< metres from the equator
};

}  // namespace

Metres meridian_arc(const geo::Ellipsoid& ellipsoid, Radians latitude) {
  // Simpson's rule over the reduced latitude, in which the meridian is an ellipse.
  const double a = ellipsoid.a(), b = ellipsoid.b();
  const double end = std::atan2(b * std::sin(latitude.value), a * std::cos(latitude.value));
  const auto speed = [&](double reduced) { return std::hypot(a * std::sin(reduced), b * std::cos(reduced)); };
  constexpr int kParts = 32;
  double sum = speed(0.0) + speed(end);
  for (int i = 1; i < kParts; ++i) sum += (i % 2 == 1 ? 4.0 : 2.0) * speed(end * i / kParts);
  return Metres(sum * end / (3.0 * kParts));
}

Radians latitude_of_arc(const geo::Ellipsoid& ellipsoid, Metres arc) {
  const double pole = meridian_arc(ellipsoid, Radians(kHalfPole)).value;
  double latitude = arc.value / pole * kHalfPole;
  for (int i = 0; i < 6; ++i) {  // Newton's method; the derivative is the meridian's radius of curvature
    const double s = std::sin(latitude);
    const double radius = ellipsoid.a() * (1.0 - ellipsoid.e2()) / std::pow(1.0 - ellipsoid.e2() * s * s, 1.5);
    latitude += (arc.value - meridian_arc(ellipsoid, Radians(latitude)).value) / radius;
    latitude = std::clamp(latitude, -kHalfPole, kHalfPole);
  }
  return Radians(latitude);
}

Result<std::unique_ptr<RasterSource>> open_scale_reference(ScaleUnit unit, const geo::Ellipsoid& world) {
  Drawing drawing;
  drawing.name = fmt::format("scale reference ({})", unit == ScaleUnit::kilometres ? "km" : "m");
  drawing.levels = halved_levels({kFullWidth, kFullWidth / 2});
  const double pixel = 360.0 / kFullWidth;
  drawing.georeference = {geographic_crs(world), {-180.0, pixel, 0.0, 90.0, 0.0, -pixel}, kFullWidth, kFullWidth / 2};
  drawing.draw = [drawn = ScaleDrawing(world, unit), levels = drawing.levels](int level, const PixelWindow& window) {
    return drawn.draw(levels[static_cast<std::size_t>(level)], window);
  };
  return open_drawing(std::move(drawing), world);
}

}  // namespace tellurion::source
