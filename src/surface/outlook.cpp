#include "surface/outlook.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "surface/rtin.h"

namespace tellurion::surface {
namespace {

constexpr int kCells = kGridSide - 1;

// Ratio of one change to the next. Below the least a surface is smoother than the data's own interpolation; at the most the
// changes would hardly end.
constexpr double kLeastRatio = 0.3;
constexpr double kMostRatio = 0.85;

/// How far each point is from what every other point shows there.
std::vector<double> changes(std::span<const double> heights, int side) {
  const std::vector<double> coarse = every_other(heights, side);
  std::vector<double> out(heights.size());
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const auto i = static_cast<std::size_t>(row * side + column);
      out[i] = std::abs(heights[i] - interpolate_in_triangles(coarse, side / 2 + 1, column / 2.0, row / 2.0));
    }
  }
  return out;
}

HeightError error_of(std::span<const double> changes, int first_column, int first_row, int cells) {
  DeviationTally tally;
  for (int row = first_row; row <= first_row + cells; ++row) {
    for (int column = first_column; column <= first_column + cells; ++column) tally.add(changes[static_cast<std::size_t>(row * kGridSide + column)]);
  }
  return {static_cast<float>(tally.largest()), static_cast<float>(tally.common())};
}

/// The blocks of the outlook's level `down`, by their number on a side.
std::size_t first_block(int down) { return ((std::size_t{1} << (2 * down)) - 4) / 3; }

}  // namespace

const Outlook::Block& Outlook::of(const geo::TileKey& tile, geo::TileKey descendant) const {
  assert(descendant.level > tile.level);
  if (descendant.level > tile.level + kOutlookLevels) descendant = geo::ancestor(descendant, tile.level + kOutlookLevels);
  const int down = descendant.level - tile.level;
  const std::size_t column = descendant.x - (tile.x << down), row = descendant.y - (tile.y << down);
  return blocks[first_block(down) + (row << down) + column];
}

std::vector<double> every_other(std::span<const double> heights, int side) {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>((side / 2 + 1) * (side / 2 + 1)));
  for (int row = 0; row < side; row += 2) {
    for (int column = 0; column < side; column += 2) out.push_back(heights[static_cast<std::size_t>(row * side + column)]);
  }
  return out;
}

Foretold foretell(std::span<const double> heights) {
  assert(heights.size() == static_cast<std::size_t>(kGridSide) * kGridSide);
  const std::vector<double> fine = changes(heights, kGridSide), coarse = changes(every_other(heights, kGridSide), kCells / 2 + 1);
  DeviationTally fine_tally, coarse_tally;
  for (const double change : fine) fine_tally.add(change);
  for (const double change : coarse) coarse_tally.add(change);
  const double seen = coarse_tally.common() > 0.0 ? fine_tally.common() / coarse_tally.common() : kLeastRatio;
  const double ratio = std::clamp(seen, kLeastRatio, kMostRatio);
  // The changes still to come add up: as independent ones do for most places, in full where it is worst.
  const double typical = ratio / std::sqrt(1.0 - ratio * ratio), worst = ratio / (1.0 - ratio);
  const auto to_come = [&](const HeightError& change, int down) {
    const double share = std::pow(ratio, down);
    const double common = change.common * typical * share;
    return HeightError{static_cast<float>(std::max(change.bound * worst * share, common)), static_cast<float>(common)};
  };

  Foretold out;
  out.error = to_come(error_of(fine, 0, 0, kCells), 0);
  for (int down = 1; down <= kOutlookLevels; ++down) {
    const int side = 1 << down, cells = kCells / side;
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        const HeightError change = error_of(fine, column * cells, row * cells, cells);
        Outlook::Block block;
        block.error = to_come(change, down);
        const double hidden = to_come(change, 0).bound;
        double lowest = heights[static_cast<std::size_t>(row * cells * kGridSide + column * cells)], highest = lowest;
        for (int y = row * cells; y <= (row + 1) * cells; ++y) {
          const auto from = heights.begin() + y * kGridSide + column * cells;
          const auto [low, high] = std::minmax_element(from, from + cells + 1);
          lowest = std::min(lowest, *low);
          highest = std::max(highest, *high);
        }
        block.min_height = static_cast<float>(lowest - hidden);
        block.max_height = static_cast<float>(highest + hidden);
        out.outlook.blocks[first_block(down) + static_cast<std::size_t>(row * side + column)] = block;
      }
    }
  }
  return out;
}

}  // namespace tellurion::surface
