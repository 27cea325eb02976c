#include "surface/slope_map.h"

#include <cstddef>
#include <vector>

#include <glm/geometric.hpp>

#include "surface/tile_grid.h"

namespace tellurion::surface {

Result<SlopeMap> build_slopes(ElevationModel& model, const geo::TileKey& key, std::stop_token stop) {
  constexpr int kCorners = kSlopeSlotSide + 1;
  constexpr double kTileTexels = kSlopeSlotSide - 2 * kSlopeGutter;
  const geo::Ellipsoid& ellipsoid = model.description().ellipsoid;
  const TileLattice lattice{key, kCorners, -kSlopeGutter / kTileTexels, 1.0 + kSlopeGutter / kTileTexels};
  const std::vector<geo::Vector<geo::Ecef>> normals = grid_normals(lattice);
  std::vector<double> heights(normals.size());
  const double texel = nominal_slope_texel(ellipsoid, key.level);
  if (Result<void> read = model.heights(lattice, texel, heights); !read) return read.error();
  if (stop.stop_requested()) return Error{ErrorCode::cancelled, "slopes of " + geo::to_string(key)};

  std::vector<glm::dvec3> base(normals.size());
  for (std::size_t i = 0; i < base.size(); ++i) base[i] = geo::surface_point(ellipsoid, normals[i]).xyz;

  SlopeMap map;
  const glm::dvec3 up = geo::tile_normal(key, {0.5, 0.5}).xyz;
  const glm::dvec3 along = geo::tile_normal(key, {1.0, 0.5}).xyz - geo::tile_normal(key, {0.0, 0.5}).xyz;
  map.tangent.xyz = glm::normalize(along - glm::dot(along, up) * up);
  map.slopes.reserve(static_cast<std::size_t>(kSlopeSlotSide) * static_cast<std::size_t>(kSlopeSlotSide));
  for (int row = 0; row < kSlopeSlotSide; ++row) {
    for (int column = 0; column < kSlopeSlotSide; ++column) {
      const std::size_t nw = static_cast<std::size_t>(row) * kCorners + static_cast<std::size_t>(column);
      const std::size_t ne = nw + 1, sw = nw + kCorners, se = sw + 1;
      // The texel's two diagonals give rise and run along two directions of the ground.
      const glm::dvec3 down = base[se] - base[nw], across = base[ne] - base[sw];
      const double rise_down = heights[se] - heights[nw], rise_across = heights[ne] - heights[sw];
      const glm::dvec3 here = normals[nw].xyz;
      const glm::dvec3 tu = glm::normalize(map.tangent.xyz - glm::dot(map.tangent.xyz, here) * here);
      const glm::dvec3 tv = glm::cross(tu, here);
      const double du = glm::dot(down, tu), dv = glm::dot(down, tv), au = glm::dot(across, tu), av = glm::dot(across, tv);
      const double det = du * av - dv * au;
      map.slopes.emplace_back(static_cast<float>((rise_down * av - rise_across * dv) / det),
                              static_cast<float>((rise_across * du - rise_down * au) / det));
    }
  }
  return map;
}

}  // namespace tellurion::surface
