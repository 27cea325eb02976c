// Clouds in pictures, found by what a base without clouds shows there.
// Thread-safe: a pure function. A value depends on what lies within kCloudReach of it, whatever else the window holds.
#pragma once

#include <cstdint>
#include <vector>

#include "prepare/base_fill.h"

namespace tellurion::prepare {

constexpr int kCloudRim = 3;  ///< pixels around a cloud that are taken for cloud too
constexpr int kCloudReach = fitted_base_reach(1) + kCloudRim;

/// 1 for pixels, row by row, that all of `colours` show brighter than the base, fitted to what surrounds them, by more than
/// `brighter` (in samples), and for those around. Windows begin at multiples of kBaseFillGrid.
std::vector<std::uint8_t> find_clouds(const std::vector<Plane>& colours, const std::vector<Plane>& base, float brighter);

}  // namespace tellurion::prepare
