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

/// Values at every row x column, from those at the control points.
void spread(std::span<const glm::dvec2> controls, int control_side, std::span<const Stencil> rows, std::span<const Stencil> columns,
            std::span<glm::dvec2> values) {
  const std::size_t side = columns.size();
  // The control points' columns first, in the rows; then every row's.
  std::vector<glm::dvec2> row_controls(static_cast<std::size_t>(control_side));
  for (std::size_t y = 0; y < rows.size(); ++y) {
    const auto& [first_row, v] = rows[y];
    const auto stride = static_cast<std::size_t>(control_side);
    const glm::dvec2* p = controls.data() + static_cast<std::size_t>(first_row) * stride;
    for (std::size_t x = 0; x < stride; ++x) row_controls[x] = v[0] * p[x] + v[1] * p[x + stride] + v[2] * p[x + 2 * stride] + v[3] * p[x + 3 * stride];
    glm::dvec2* to = values.data() + y * side;
    for (std::size_t x = 0; x < side; ++x) {
      const auto& [first, w] = columns[x];
      const glm::dvec2* q = row_controls.data() + first;
      to[x] = w[0] * q[0] + w[1] * q[1] + w[2] * q[2] + w[3] * q[3];
    }
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

LatticePixels::InRaster LatticePixels::in_raster(source::RasterReader& reader, const source::RasterDescription& raster, int level) const {
  InRaster out;
  out.side_ = lattice_.side;
  const double width = raster.levels.front().width;
  if (raster.wraps) out.wrap_width_ = width;
  const auto is_good = [&] {
    std::vector<glm::dvec2> expected(middles_.size()), found(middles_.size());
    reader.to_pixels(middles_, expected);
    std::vector<Stencil> stencils;
    for (int i = 0; i + 1 < control_side_; ++i) stencils.push_back(stencil(i + 0.5, control_side_));
    spread(out.pixels_, control_side_, stencils, stencils, found);
    const glm::dvec2 scale = source::level_scale(raster, level);
    for (std::size_t i = 0; i < found.size(); ++i) {
      glm::dvec2 off = (found[i] - expected[i]) * scale;
      if (raster.wraps) off.x = std::remainder(off.x, width * scale.x);
      if (!(std::abs(off.x) <= kTolerancePixels && std::abs(off.y) <= kTolerancePixels)) return false;  // NaN too
    }
    return true;
  };

  if (control_side_ > 0) {
    out.pixels_.resize(controls_.size());
    reader.to_pixels(controls_, out.pixels_);
    if (raster.wraps) {
      // Every point to within half a turn of the one before it.
      const auto side = static_cast<std::size_t>(control_side_);
      for (std::size_t i = 1; i < out.pixels_.size(); ++i) {
        const double before = out.pixels_[i % side > 0 ? i - 1 : i - side].x;
        out.pixels_[i].x = before + std::remainder(out.pixels_[i].x - before, width);
      }
    }
    if (is_good()) {
      out.control_side_ = control_side_;
      return out;
    }
  }
  const std::vector<geo::LatLon> places = places_of(lattice_);
  out.pixels_.resize(places.size());
  reader.to_pixels(places, out.pixels_);
  return out;
}

void LatticePixels::InRaster::rows(int first_row, std::span<glm::dvec2> pixels) const {
  if (control_side_ == 0) {
    const auto first = pixels_.begin() + static_cast<std::ptrdiff_t>(first_row) * side_;
    std::copy(first, first + static_cast<std::ptrdiff_t>(pixels.size()), pixels.begin());
    return;
  }
  const int row_count = static_cast<int>(pixels.size()) / side_;
  std::vector<Stencil> rows, columns;
  for (int i = 0; i < row_count; ++i) rows.push_back(stencil(static_cast<double>(first_row + i) / kStep, control_side_));
  for (int i = 0; i < side_; ++i) columns.push_back(stencil(static_cast<double>(i) / kStep, control_side_));
  spread(pixels_, control_side_, rows, columns, pixels);
  if (wrap_width_ > 0.0) {
    for (glm::dvec2& pixel : pixels) pixel.x -= wrap_width_ * std::floor(pixel.x / wrap_width_);
  }
}

bool overlap(const geo::GeodeticBounds& a, const geo::GeodeticBounds& b) {
  if (a.south > b.north || b.south > a.north) return false;
  const double turn = 2.0 * kPi;
  double b_from_a = b.west.value - a.west.value;
  b_from_a -= turn * std::floor(b_from_a / turn);
  return b_from_a <= a.east.value - a.west.value || turn - b_from_a <= b.east.value - b.west.value;
}

}  // namespace tellurion::surface
