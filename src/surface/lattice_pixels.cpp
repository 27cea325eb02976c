#include "surface/lattice_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <glm/common.hpp>

namespace tellurion::surface {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kStep = 8;                     ///< points from one projected point to the next
constexpr int kLeastControls = 4;            ///< that a cubic goes through
constexpr double kTolerancePixels = 1e-6;

std::vector<geo::LatLon> places_of(const TileLattice& lattice) {
  const std::vector<geo::Vector<geo::Ecef>> normals = grid_normals(lattice);
  std::vector<geo::LatLon> places(normals.size());
  std::transform(normals.begin(), normals.end(), places.begin(), geo::place_of_normal);
  return places;
}

/// What four control points in a row, the first of them at `first`, weigh at a place between or beside them.
struct Stencil {
  int first = 0;
  std::array<double, 4> weights{};
};

/// `at`: in control points.
Stencil stencil(double at, int control_side) {
  const int first = std::clamp(static_cast<int>(at) - 1, 0, control_side - kLeastControls);
  const double x = at - first;
  return {first, {(x - 1) * (x - 2) * (x - 3) / -6, x * (x - 2) * (x - 3) / 2, x * (x - 1) * (x - 3) / -2, x * (x - 1) * (x - 2) / 6}};
}

/// Values at every `stencils[row]` x `stencils[column]`, from those at the control points.
void spread(std::span<const glm::dvec2> controls, int control_side, std::span<const Stencil> stencils, std::span<glm::dvec2> values) {
  const auto side = stencils.size();
  std::vector<glm::dvec2> rows(static_cast<std::size_t>(control_side) * side);
  for (std::size_t row = 0; row < static_cast<std::size_t>(control_side); ++row) {
    const glm::dvec2* from = controls.data() + row * static_cast<std::size_t>(control_side);
    for (std::size_t x = 0; x < side; ++x) {
      const auto& [first, w] = stencils[x];
      const glm::dvec2* p = from + first;
      rows[row * side + x] = w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + w[3] * p[3];
    }
  }
  for (std::size_t y = 0; y < side; ++y) {
    const auto& [first, w] = stencils[y];
    const glm::dvec2* p = rows.data() + static_cast<std::size_t>(first) * side;
    glm::dvec2* to = values.data() + y * side;
    for (std::size_t x = 0; x < side; ++x) to[x] = w[0] * p[x] + w[1] * p[x + side] + w[2] * p[x + 2 * side] + w[3] * p[x + 3 * side];
  }
}

/// Of places in rows of `side`, with `margin` (radians on the ground) round them.
geo::GeodeticBounds bounds_of(std::span<const geo::LatLon> places, int side, double margin) {
  double south = kPi / 2, north = -kPi / 2, west = INFINITY, east = -INFINITY;
  std::vector<double> longitudes(places.size());
  bool round_a_pole = false;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const geo::LatLon& place = places[i];
    south = std::min(south, place.latitude.value - margin);
    north = std::max(north, place.latitude.value + margin);
    longitudes[i] = place.longitude.value;
    if (i == 0) {
      west = east = longitudes[0];
      continue;
    }
    const auto row = static_cast<std::size_t>(side);
    const double before = longitudes[i % row > 0 ? i - 1 : i - row];
    const double step = std::remainder(longitudes[i] - before, 2.0 * kPi);
    round_a_pole = round_a_pole || std::abs(step) > kPi / 4;
    longitudes[i] = before + step;
    west = std::min(west, longitudes[i]);
    east = std::max(east, longitudes[i]);
  }
  const double highest = std::max(std::abs(south), std::abs(north));
  const double sideways = highest < kPi / 2 ? margin / std::cos(highest) : kPi;
  if (round_a_pole || east - west + 2.0 * sideways >= 2.0 * kPi) return {Radians(south), Radians(north), Radians(-kPi), Radians(kPi)};
  return {Radians(south), Radians(north), Radians(west - sideways), Radians(east + sideways)};
}

}  // namespace

LatticePixels::LatticePixels(const TileLattice& lattice) : lattice_(lattice) {
  const double step = (lattice.last - lattice.first) / (lattice.side - 1);
  const int cells = (lattice.side - 1 + kStep - 1) / kStep;
  const double margin = kStep * step * geo::tile_angle(lattice.key.level).value;
  if (cells + 1 < kLeastControls) {
    bounds_ = bounds_of(places_of(lattice), lattice.side, margin);
    return;
  }
  control_side_ = cells + 1;
  const double half = 0.5 * kStep * step;
  controls_ = places_of({lattice.key, control_side_, lattice.first, lattice.first + 2.0 * half * cells});
  middles_ = places_of({lattice.key, cells, lattice.first + half, lattice.first + half + 2.0 * half * (cells - 1)});
  bounds_ = bounds_of(controls_, control_side_, margin);
}

void LatticePixels::find(source::RasterReader& reader, const source::RasterDescription& raster, int level, std::span<glm::dvec2> pixels) const {
  if (control_side_ > 0 && interpolate(reader, raster, level, pixels)) return;
  reader.to_pixels(places_of(lattice_), pixels);
}

bool LatticePixels::interpolate(source::RasterReader& reader, const source::RasterDescription& raster, int level,
                                std::span<glm::dvec2> pixels) const {
  std::vector<glm::dvec2> controls(controls_.size()), expected(middles_.size()), found(middles_.size());
  reader.to_pixels(controls_, controls);
  reader.to_pixels(middles_, expected);
  const double width = raster.levels.front().width;
  if (raster.wraps) {
    // Every point to within half a turn of the one before it.
    const auto side = static_cast<std::size_t>(control_side_);
    for (std::size_t i = 1; i < controls.size(); ++i) {
      const double before = controls[i % side > 0 ? i - 1 : i - side].x;
      controls[i].x = before + std::remainder(controls[i].x - before, width);
    }
  }

  std::vector<Stencil> stencils;
  for (int i = 0; i + 1 < control_side_; ++i) stencils.push_back(stencil(i + 0.5, control_side_));
  spread(controls, control_side_, stencils, found);
  const glm::dvec2 scale = source::level_scale(raster, level);
  for (std::size_t i = 0; i < found.size(); ++i) {
    glm::dvec2 off = (found[i] - expected[i]) * scale;
    if (raster.wraps) off.x = std::remainder(off.x, width * scale.x);
    if (!(std::abs(off.x) <= kTolerancePixels && std::abs(off.y) <= kTolerancePixels)) return false;  // NaN too
  }

  stencils.clear();
  for (int i = 0; i < lattice_.side; ++i) stencils.push_back(stencil(static_cast<double>(i) / kStep, control_side_));
  spread(controls, control_side_, stencils, pixels);
  if (raster.wraps) {
    for (glm::dvec2& pixel : pixels) pixel.x -= width * std::floor(pixel.x / width);
  }
  return true;
}

bool overlap(const geo::GeodeticBounds& a, const geo::GeodeticBounds& b) {
  if (a.south > b.north || b.south > a.north) return false;
  const double turn = 2.0 * kPi;
  double b_from_a = b.west.value - a.west.value;
  b_from_a -= turn * std::floor(b_from_a / turn);
  return b_from_a <= a.east.value - a.west.value || turn - b_from_a <= b.east.value - b.west.value;
}

}  // namespace tellurion::surface
