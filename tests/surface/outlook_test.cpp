#include "surface/outlook.h"

#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "geo/tile_key.h"
#include "surface/rtin.h"

using namespace tellurion;
using namespace tellurion::surface;

namespace {

/// Self-similar terrain over [0, 1]^2: octaves from 3 waves on a side, each `ratio` as high as the one before. Turned, so that no wave
/// runs along the grid.
double terrain(double x, double y, double ratio) {
  double sum = 0, amplitude = 1000;
  for (int octave = 0; octave < 16; ++octave, amplitude *= ratio) {
    const double k = 2 * M_PI * 3 * std::exp2(octave), turn = 0.7 + 1.3 * octave;
    sum += amplitude * std::sin(k * (x * std::cos(turn) + y * std::sin(turn)) + octave) * std::sin(k * (y * std::cos(turn) - x * std::sin(turn)) + 2.0 * octave);
  }
  return sum;
}

template <class Height>
std::vector<double> grid_of(const Height& height, double x0, double y0, double size, int side = kGridSide) {
  std::vector<double> out;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) out.push_back(height(x0 + size * column / (side - 1), y0 + size * row / (side - 1)));
  }
  return out;
}

/// What 99 hundredths of the places of a grid of this size stay below, and the largest, found at eight times its resolution.
template <class Height>
HeightError true_error(const Height& height, double x0, double y0, double size) {
  const std::vector<double> drawn = grid_of(height, x0, y0, size);
  constexpr int kFine = 8 * (kGridSide - 1) + 1;
  DeviationTally tally;
  const std::vector<double> truth = grid_of(height, x0, y0, size, kFine);
  for (int row = 0; row < kFine; ++row) {
    for (int column = 0; column < kFine; ++column)
      tally.add(std::abs(truth[static_cast<std::size_t>(row * kFine + column)] - interpolate_in_triangles(drawn, kGridSide, column / 8.0, row / 8.0)));
  }
  return {static_cast<float>(tally.largest()), static_cast<float>(tally.common())};
}

const geo::TileKey kTile{2, 6, 40, 17};

}  // namespace

TEST_CASE("foretell: of level ground nothing is foretold but its height") {
  const Foretold foretold = foretell(std::vector<double>(kGridSide * kGridSide, 123.0));
  CHECK(foretold.error == HeightError{});
  for (const Outlook::Block& block : foretold.outlook.blocks) {
    CHECK(block.error == HeightError{});
    CHECK(block.min_height == 123.0f);
    CHECK(block.max_height == 123.0f);
  }
}

TEST_CASE("foretell: errors of self-similar terrain, its own and three levels down, are right within a factor of two") {
  for (const double ratio : {0.4, 0.5, 0.6, 0.7}) {
    const auto height = [&](double x, double y) { return terrain(x, y, ratio); };
    const Foretold foretold = foretell(grid_of(height, 0, 0, 1));
    CAPTURE(ratio);
    const HeightError own = true_error(height, 0, 0, 1);
    CHECK(judged(foretold.error) > judged(own) / 2);
    CHECK(judged(foretold.error) < judged(own) * 2);
    for (const auto& [column, row] : {std::pair{1, 6}, {4, 3}, {7, 7}}) {
      const geo::TileKey below{kTile.face, 9, kTile.x * 8 + static_cast<unsigned>(column), kTile.y * 8 + static_cast<unsigned>(row)};
      const HeightError error = true_error(height, column / 8.0, row / 8.0, 1 / 8.0);
      const Outlook::Block& block = foretold.outlook.of(kTile, below);
      CHECK(judged(block.error) > judged(error) / 2);
      CHECK(judged(block.error) < judged(error) * 2);
    }
  }
}

TEST_CASE("Outlook::of: the range of a descendant's heights, at every level and deeper") {
  const auto height = [](double x, double y) { return 5000 * x - 3000 * y + terrain(x, y, 0.5) / 10; };
  const Foretold foretold = foretell(grid_of(height, 0, 0, 1));
  for (int down = 1; down <= 5; ++down) {
    const unsigned side = 1u << down;
    for (const auto& [column, row] : {std::pair{0u, 0u}, {side - 1, 0u}, {0u, side - 1}, {side / 2, side / 2 - 1}}) {
      const geo::TileKey below{kTile.face, static_cast<std::uint8_t>(kTile.level + down), (kTile.x << down) + column, (kTile.y << down) + row};
      const Outlook::Block& block = foretold.outlook.of(kTile, below);
      double lowest = 1e9, highest = -1e9;
      for (const double h : grid_of(height, static_cast<double>(column) / side, static_cast<double>(row) / side, 1.0 / side)) {
        lowest = std::min(lowest, h);
        highest = std::max(highest, h);
      }
      CAPTURE(down);
      CHECK(static_cast<double>(block.min_height) <= lowest);
      CHECK(static_cast<double>(block.max_height) >= highest);
      const double block_side = 1.0 / std::min(side, 8u);
      CHECK(static_cast<double>(block.max_height - block.min_height) < 8000 * block_side + 400);
    }
  }
}
