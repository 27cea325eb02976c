#include "surface/tile_grid.h"

#include <cstddef>

#include "surface/tile_content.h"

namespace tellurion::surface {

std::vector<geo::Vector<geo::Ecef>> grid_normals(const geo::TileKey& key, int side, double first, double last) {
  std::vector<geo::Vector<geo::Ecef>> normals;
  normals.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  const double intervals = side - 1;
  const auto along = [&](int i) { return first + (last - first) * (i / intervals); };
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      normals.push_back(geo::tile_normal(key, {along(column), along(row)}));
    }
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
