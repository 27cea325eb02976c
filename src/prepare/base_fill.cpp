#include "prepare/base_fill.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

namespace tellurion::prepare {
namespace {

constexpr int kFinestFit = 4;              ///< level of the fit's smallest cells: 16 pixels
constexpr int kCoarsestFit = 7;
constexpr int kCoarsestDifference = 5;     ///< differences fade out over cells of 32 pixels
constexpr double kPriorPixels = 512.0;     ///< as much as so many pixels weighs the fit of the coarser cell
constexpr double kLeastVariance = 1.0;     ///< of the base, in its samples' units
constexpr double kLeastGain = 0.5, kMostGain = 2.0;

static_assert(kBaseFillGrid == 1 << kCoarsestFit);
static_assert(fitted_base_reach(0) == (1 << (kCoarsestFit + 1)) - (1 << kFinestFit) + (1 << kCoarsestFit));
static_assert(kBaseFillReach >= fitted_base_reach(0) + (1 << (kCoarsestDifference + 1)) - 2 + (1 << kCoarsestDifference));

/// Values in cells, row by row.
template <class T>
struct Grid {
  int width = 0;
  int height = 0;
  std::vector<T> cells;

  Grid(int its_width, int its_height) : width(its_width), height(its_height), cells(static_cast<std::size_t>(its_width) * static_cast<std::size_t>(its_height)) {}
  T& at(int x, int y) { return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
  const T& at(int x, int y) const { return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
};

/// The place `at` (cells, centres at halves) between two cells of `count`, and the share of the second.
struct Between {
  int first = 0;
  int second = 0;
  float share = 0.0F;

  Between(float at, int count) {
    const float left = std::floor(at - 0.5F);
    share = at - 0.5F - left;
    first = std::clamp(static_cast<int>(left), 0, count - 1);
    second = std::clamp(static_cast<int>(left) + 1, 0, count - 1);
  }
};

/// Bilinear, of what `of` takes from a cell.
template <class T, class Of>
float between(const Grid<T>& grid, const Between& column, const Between& row, const Of& of) {
  const float upper = of(grid.at(column.first, row.first)) * (1.0F - column.share) + of(grid.at(column.second, row.first)) * column.share;
  const float lower = of(grid.at(column.first, row.second)) * (1.0F - column.share) + of(grid.at(column.second, row.second)) * column.share;
  return upper * (1.0F - row.share) + lower * row.share;
}

// --- Gain and offset -------------------------------------------------------------------------------------------------

/// Sums over the pixels of a cell: of the base alone, and where there are samples too.
struct Sums {
  double base_count = 0.0, base = 0.0, base_squared = 0.0;
  double count = 0.0, of_base = 0.0, of_samples = 0.0, of_base_squared = 0.0, of_products = 0.0;

  void add(const Sums& other) {
    base_count += other.base_count;
    base += other.base;
    base_squared += other.base_squared;
    count += other.count;
    of_base += other.of_base;
    of_samples += other.of_samples;
    of_base_squared += other.of_base_squared;
    of_products += other.of_products;
  }
};

struct Fit {
  float gain = 1.0F;
  float offset = 0.0F;
};

Grid<Sums> sum_cells(const Plane& window, const Plane& base) {
  constexpr int kSide = 1 << kFinestFit;
  Grid<Sums> sums((window.width + kSide - 1) / kSide, (window.height + kSide - 1) / kSide);
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      if (std::isnan(base.at(x, y))) continue;
      Sums& cell = sums.at(x / kSide, y / kSide);
      const auto b = static_cast<double>(base.at(x, y)), sample = static_cast<double>(window.at(x, y));
      cell.base_count += 1.0;
      cell.base += b;
      cell.base_squared += b * b;
      if (std::isnan(window.at(x, y))) continue;
      cell.count += 1.0;
      cell.of_base += b;
      cell.of_samples += sample;
      cell.of_base_squared += b * b;
      cell.of_products += b * sample;
    }
  }
  return sums;
}

Grid<Sums> coarser(const Grid<Sums>& fine) {
  Grid<Sums> coarse((fine.width + 1) / 2, (fine.height + 1) / 2);
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) coarse.at(x / 2, y / 2).add(fine.at(x, y));
  }
  return coarse;
}

/// Least squares around the mean of the base in the cell, with `prior` as kPriorPixels more pixels.
Fit fit_cell(const Sums& sums, const Fit& prior) {
  if (sums.count == 0.0) return prior;
  const double mean = sums.base / sums.base_count, spread = std::max(sums.base_squared / sums.base_count - mean * mean, 0.0) + kLeastVariance;
  const double x = sums.of_base - sums.count * mean;
  const double xx = sums.of_base_squared - 2.0 * mean * sums.of_base + sums.count * mean * mean, xs = sums.of_products - mean * sums.of_samples;
  const double a = xx + kPriorPixels * spread, c = sums.count + kPriorPixels;
  const double right_gain = xs + kPriorPixels * spread * static_cast<double>(prior.gain);
  const double right_level = sums.of_samples + kPriorPixels * (static_cast<double>(prior.gain) * mean + static_cast<double>(prior.offset));
  const double gain = std::clamp((right_gain * c - right_level * x) / (a * c - x * x), kLeastGain, kMostGain);
  const double level = (right_level - gain * x) / c;
  return {static_cast<float>(gain), static_cast<float>(level - gain * mean)};
}

Fit fit_between(const Grid<Fit>& fits, const Between& column, const Between& row) {
  return {between(fits, column, row, [](const Fit& fit) { return fit.gain; }), between(fits, column, row, [](const Fit& fit) { return fit.offset; })};
}

/// In cells of 16 pixels.
Grid<Fit> fit_cells(const Plane& window, const Plane& base, int coarsest) {
  std::vector<Grid<Sums>> levels{sum_cells(window, base)};
  for (int level = kFinestFit; level < coarsest; ++level) levels.push_back(coarser(levels.back()));
  Grid<Fit> fits(1, 1);
  while (!levels.empty()) {
    const Grid<Sums>& sums = levels.back();
    Grid<Fit> finer(sums.width, sums.height);
    for (int y = 0; y < sums.height; ++y) {
      const Between row((static_cast<float>(y) + 0.5F) / 2.0F, fits.height);
      for (int x = 0; x < sums.width; ++x) finer.at(x, y) = fit_cell(sums.at(x, y), fit_between(fits, {(static_cast<float>(x) + 0.5F) / 2.0F, fits.width}, row));
    }
    fits = std::move(finer);
    levels.pop_back();
  }
  return fits;
}

/// The base with gain and offset.
Plane fitted(const Plane& base, const Grid<Fit>& fits) {
  constexpr float kSide = 1 << kFinestFit;
  Plane result = base;
  for (int y = 0; y < base.height; ++y) {
    const Between row((static_cast<float>(y) + 0.5F) / kSide, fits.height);
    for (int x = 0; x < base.width; ++x) {
      const Fit fit = fit_between(fits, {(static_cast<float>(x) + 0.5F) / kSide, fits.width}, row);
      result.at(x, y) = fit.gain * base.at(x, y) + fit.offset;
    }
  }
  return result;
}

// --- Differences -----------------------------------------------------------------------------------------------------

/// A difference and how sure it is, from 0 to 1.
struct Known {
  float value = 0.0F;
  float weight = 0.0F;
};

Grid<Known> coarser(const Grid<Known>& fine) {
  Grid<Known> coarse((fine.width + 1) / 2, (fine.height + 1) / 2);
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const Known& from = fine.at(x, y);
      Known& to = coarse.at(x / 2, y / 2);
      to.value += from.weight * from.value;
      to.weight += from.weight;
    }
  }
  for (Known& cell : coarse.cells) {
    if (cell.weight > 0.0F) cell.value /= cell.weight;
    cell.weight = std::min(cell.weight, 1.0F);
  }
  return coarse;
}

/// Known differences as they are, the others from coarser and coarser cells; 0 far from all (pull and push).
Grid<Known> spread(Grid<Known> differences, int level) {
  if (level == kCoarsestDifference) return differences;
  const Grid<Known> coarse = spread(coarser(differences), level + 1);
  for (int y = 0; y < differences.height; ++y) {
    const Between row((static_cast<float>(y) + 0.5F) / 2.0F, coarse.height);
    for (int x = 0; x < differences.width; ++x) {
      Known& cell = differences.at(x, y);
      if (cell.weight >= 1.0F) continue;
      const float around = between(coarse, {(static_cast<float>(x) + 0.5F) / 2.0F, coarse.width}, row, [](const Known& known) { return known.value; });
      cell.value = cell.weight * cell.value + (1.0F - cell.weight) * around;
    }
  }
  return differences;
}

}  // namespace

Plane fitted_base(const Plane& window, const Plane& base, int finer) {
  assert(window.width == base.width && window.height == base.height);
  return fitted(base, fit_cells(window, base, kCoarsestFit - finer));
}

Plane fill_from_base(const Plane& window, const Plane& base) {
  Plane filling = fitted_base(window, base, 0);
  Grid<Known> differences(window.width, window.height);
  for (std::size_t i = 0; i < window.values.size(); ++i) {
    const float difference = window.values[i] - filling.values[i];
    if (!std::isnan(difference)) differences.cells[i] = {difference, 1.0F};
  }
  differences = spread(std::move(differences), 0);
  for (std::size_t i = 0; i < window.values.size(); ++i) {
    filling.values[i] = std::isnan(window.values[i]) ? filling.values[i] + differences.cells[i].value : std::nanf("");
  }
  return filling;
}

}  // namespace tellurion::prepare
