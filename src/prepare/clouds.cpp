#include "prepare/clouds.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace tellurion::prepare {
namespace {

/// By how much the colours are brighter than the base, least of all; NaN where one has none.
std::vector<float> least_excess(const std::vector<Plane>& colours, const std::vector<Plane>& base) {
  std::vector<float> least(colours.front().values.size(), std::numeric_limits<float>::infinity());
  for (std::size_t colour = 0; colour < colours.size(); ++colour) {
    for (std::size_t i = 0; i < least.size(); ++i) {
      const float excess = colours[colour].values[i] - base[colour].values[i];
      if (!std::isnan(least[i]) && !(excess >= least[i])) least[i] = excess;
    }
  }
  return least;
}

Plane without(Plane plane, const std::vector<float>& excess, float most) {
  for (std::size_t i = 0; i < excess.size(); ++i) {
    if (excess[i] > most) plane.values[i] = std::nanf("");
  }
  return plane;
}

/// Widens what is marked along rows (`step` 1) or columns (`step` the width).
void widen(std::vector<std::uint8_t>& marks, int lines, std::size_t line_step, int length, std::size_t step) {
  std::vector<std::uint8_t> line(static_cast<std::size_t>(length));
  for (int i = 0; i < lines; ++i) {
    const std::size_t first = static_cast<std::size_t>(i) * line_step;
    std::fill(line.begin(), line.end(), std::uint8_t{0});
    for (int at = 0; at < length; ++at) {
      if (marks[first + static_cast<std::size_t>(at) * step] == 0) continue;
      std::fill(line.begin() + std::max(at - kCloudRim, 0), line.begin() + std::min(at + kCloudRim + 1, length), std::uint8_t{1});
    }
    for (int at = 0; at < length; ++at) marks[first + static_cast<std::size_t>(at) * step] = line[static_cast<std::size_t>(at)];
  }
}

}  // namespace

std::vector<std::uint8_t> find_clouds(const std::vector<Plane>& colours, const std::vector<Plane>& base, float brighter) {
  assert(!colours.empty() && colours.size() == base.size());
  const std::vector<float> first_look = least_excess(colours, base);
  std::vector<Plane> fitted;
  for (std::size_t colour = 0; colour < colours.size(); ++colour) fitted.push_back(fitted_base(without(colours[colour], first_look, brighter), base[colour], 1));
  const std::vector<float> excess = least_excess(colours, fitted);
  std::vector<std::uint8_t> clouds(excess.size());
  std::transform(excess.begin(), excess.end(), clouds.begin(), [brighter](float one) { return static_cast<std::uint8_t>(one > brighter); });
  const int width = colours.front().width, height = colours.front().height;
  widen(clouds, height, static_cast<std::size_t>(width), width, 1);
  widen(clouds, width, 1, height, static_cast<std::size_t>(width));
  return clouds;
}

}  // namespace tellurion::prepare
