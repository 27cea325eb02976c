// Undulations at all samples of a window, from few evaluations where that is good enough.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "base/quantity.h"

namespace tellurion::source {

/// Undulations, in metres, at samples of the window.
using UndulationsAt = std::function<void(std::span<const glm::ivec2> samples, std::span<double> metres)>;

/// Row-major undulations at `size` samples that lie `spacing` apart; within 1 mm of `at` for geoid grids of one minute of
/// arc or coarser: cells of at most 1500 m then hold one line of grid points per axis at most, so that interpolation errs
/// by no more than twice what it errs in the cell's middles, and cells that err there by 0.25 mm are cut into four.
std::vector<float> undulation_field(glm::ivec2 size, Metres spacing, const UndulationsAt& at);

}  // namespace tellurion::source
