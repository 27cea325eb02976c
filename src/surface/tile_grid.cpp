#include "surface/tile_grid.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "surface/tile_content.h"

namespace tellurion::surface {

std::vector<geo::Vector<geo::Ecef>> grid_normals(const TileLattice& lattice) {
  const auto& [key, side, first, last] = lattice;
  // The mapping of geo::face_normal, with one tangent a column and row instead of two a point. The face's axes are axes of
  // ECEF; a border's slope is exactly 1, so that two faces agree on it to the bit.
  const geo::FaceRect rect = geo::face_rect(key);
  const glm::dvec3 out = geo::face_normal(key.face, {0.0, 0.0}).xyz;
  const glm::dvec3 right = glm::round(geo::face_normal(key.face, {1.0, 0.0}).xyz * std::numbers::sqrt2 - out);
  const glm::dvec3 down = glm::round(geo::face_normal(key.face, {0.0, 1.0}).xyz * std::numbers::sqrt2 - out);
  const auto slope = [&](int i, double lower, double size) {
    const double u = lower + size * (first + (last - first) * (i / (side - 1.0)));
    return std::abs(u) == 1.0 ? u : std::tan(u * std::numbers::pi / 4.0);
  };
  std::vector<double> across;
  for (int i = 0; i < side; ++i) across.push_back(slope(i, rect.lower.x, rect.upper.x - rect.lower.x));
  std::vector<geo::Vector<geo::Ecef>> normals;
  normals.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int row = 0; row < side; ++row) {
    const glm::dvec3 begin = out + down * slope(row, rect.lower.y, rect.upper.y - rect.lower.y);
    for (const double x : across) normals.push_back({glm::normalize(begin + right * x)});
  }
  return normals;
}

double nominal_tile_size(const geo::Ellipsoid& ellipsoid, int level) {
  return ellipsoid.a() * geo::tile_angle(level).value;
}

double nominal_grid_spacing(const geo::Ellipsoid& ellipsoid, int level) {
  return nominal_tile_size(ellipsoid, level) / (kGridSide - 1);
}

double nominal_colour_texel(const geo::Ellipsoid& ellipsoid, int level) {
  return nominal_tile_size(ellipsoid, level) / (kColourSlotSide - 2 * kColourGutter);
}

double nominal_slope_texel(const geo::Ellipsoid& ellipsoid, int level) {
  return nominal_tile_size(ellipsoid, level) / (kSlopeSlotSide - 2 * kSlopeGutter);
}

}  // namespace tellurion::surface
