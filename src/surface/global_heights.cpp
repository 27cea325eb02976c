#include "surface/global_heights.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <glm/common.hpp>

#include "surface/tile_grid.h"

namespace tellurion::surface {
namespace {

constexpr std::size_t kSide = kGridSide;

}  // namespace

Result<GlobalHeights> GlobalHeights::make(ElevationModel& model) {
  GlobalHeights global;
  global.spacing_ = nominal_grid_spacing(model.description().ellipsoid, 0);
  global.metres_.reserve(geo::kFaceCount * kSide * kSide);
  std::vector<double> metres(kSide * kSide);
  for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) {
    const TileLattice lattice{{face, 0, 0, 0}, kGridSide};
    if (Result<void> read = model.heights(lattice, global.spacing_, metres); !read) return read.error();
    for (const double height : metres) global.metres_.push_back(static_cast<float>(height));
  }
  return global;
}

double GlobalHeights::at(const geo::LatLon& place) const {
  const geo::FacePoint on_face = geo::face_point(geo::normal_at(place));
  const glm::dvec2 at = glm::clamp(0.5 * (on_face.uv + 1.0), 0.0, 1.0) * static_cast<double>(kSide - 1);
  const auto column = std::min(static_cast<std::size_t>(at.x), kSide - 2), row = std::min(static_cast<std::size_t>(at.y), kSide - 2);
  const float* upper = &metres_[(static_cast<std::size_t>(on_face.face) * kSide + row) * kSide + column];
  const float* lower = upper + kSide;
  const glm::dvec2 share = at - glm::dvec2(static_cast<double>(column), static_cast<double>(row));
  const auto mix = [&](const float* pair) { return glm::mix(static_cast<double>(pair[0]), static_cast<double>(pair[1]), share.x); };
  return glm::mix(mix(upper), mix(lower), share.y);
}

}  // namespace tellurion::surface
