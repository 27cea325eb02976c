#include "source/proj/undulation_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <glm/common.hpp>

namespace tellurion::source {
namespace {

constexpr double kCellMetres = 1500.0;
constexpr double kToleranceMetres = 0.25e-3;
constexpr int kLargestCell = 32;  ///< samples
constexpr int kSmallestCell = 4;  ///< smaller ones save nothing

/// Samples from `lower` to `upper`, both included.
struct Cell {
  glm::ivec2 lower;
  glm::ivec2 upper;
};

constexpr std::size_t kProbes = 9;

/// Three by three samples: corners, middles of the sides, middle.
std::array<glm::ivec2, kProbes> probes(const Cell& cell) {
  const std::array<int, 3> x{cell.lower.x, (cell.lower.x + cell.upper.x) / 2, cell.upper.x};
  const std::array<int, 3> y{cell.lower.y, (cell.lower.y + cell.upper.y) / 2, cell.upper.y};
  std::array<glm::ivec2, kProbes> result;
  for (std::size_t i = 0; i < kProbes; ++i) result[i] = {x[i % 3], y[i / 3]};
  return result;
}

/// The bilinear surface through the corners of `cell`, whose probes are `values`.
double interpolate(const Cell& cell, std::span<const double> values, glm::ivec2 sample) {
  const glm::dvec2 t = glm::dvec2(sample - cell.lower) / glm::dvec2(glm::max(cell.upper - cell.lower, 1));
  return (values[0] * (1 - t.x) + values[2] * t.x) * (1 - t.y) + (values[6] * (1 - t.x) + values[8] * t.x) * t.y;
}

}  // namespace

std::vector<float> undulation_field(glm::ivec2 size, Metres spacing, const UndulationsAt& at) {
  std::vector<float> field(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
  const auto put = [&](glm::ivec2 sample, double metres) {
    field[static_cast<std::size_t>(sample.y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(sample.x)] = static_cast<float>(metres);
  };
  std::vector<glm::ivec2> one_by_one;
  const auto each = [](const Cell& cell, const auto& what) {
    for (int y = cell.lower.y; y <= cell.upper.y; ++y) {
      for (int x = cell.lower.x; x <= cell.upper.x; ++x) what(glm::ivec2(x, y));
    }
  };

  int side = static_cast<int>(std::min<double>(kLargestCell, kCellMetres / spacing.value));
  std::vector<Cell> cells;
  if (side < kSmallestCell) {
    each({glm::ivec2(0), size - 1}, [&](glm::ivec2 sample) { one_by_one.push_back(sample); });
  } else {
    for (int y = 0; y < size.y; y += side) {
      for (int x = 0; x < size.x; x += side) cells.push_back({{x, y}, glm::min(glm::ivec2(x, y) + side, size) - 1});
    }
  }
  std::vector<glm::ivec2> samples;
  std::vector<double> values;
  for (; !cells.empty(); side /= 2) {
    samples.clear();
    for (const Cell& cell : cells) {
      for (const glm::ivec2& probe : probes(cell)) samples.push_back(probe);
    }
    values.resize(samples.size());
    at(samples, values);
    std::vector<Cell> quarters;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Cell& cell = cells[i];
      const std::span<const double> corners = std::span<const double>(values).subspan(i * kProbes, kProbes);
      bool straight = true;
      for (std::size_t p = 0; p < kProbes; ++p) {
        straight = straight && std::abs(corners[p] - interpolate(cell, corners, samples[i * kProbes + p])) <= kToleranceMetres;
      }
      if (straight) {
        each(cell, [&](glm::ivec2 sample) { put(sample, interpolate(cell, corners, sample)); });
      } else if (side < 2 * kSmallestCell) {
        each(cell, [&](glm::ivec2 sample) { one_by_one.push_back(sample); });
      } else {
        const glm::ivec2 middle = (cell.lower + cell.upper) / 2;
        for (const Cell& quarter : {Cell{cell.lower, middle}, Cell{{middle.x + 1, cell.lower.y}, {cell.upper.x, middle.y}},
                                    Cell{{cell.lower.x, middle.y + 1}, {middle.x, cell.upper.y}}, Cell{middle + 1, cell.upper}}) {
          if (quarter.lower.x <= quarter.upper.x && quarter.lower.y <= quarter.upper.y) quarters.push_back(quarter);
        }
      }
    }
    cells = std::move(quarters);
  }
  if (!one_by_one.empty()) {
    values.resize(one_by_one.size());
    at(one_by_one, values);
    for (std::size_t i = 0; i < one_by_one.size(); ++i) put(one_by_one[i], values[i]);
  }
  return field;
}

}  // namespace tellurion::source
