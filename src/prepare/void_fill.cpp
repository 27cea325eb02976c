#include "prepare/void_fill.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

namespace tellurion::prepare {
namespace {

constexpr double kTension = 0.01;      ///< per pixel squared: over more than ten pixels the plate gives way to a membrane, which does not overshoot
constexpr double kAccuracy = 3e-5;     ///< of the forces that are left, in those of a plate that is flat in the void
constexpr double kLeastForce = 1e-3;   ///< in units of the heights: what is as even is solved as well as numbers allow
constexpr int kMostIterations = 4000;
constexpr int kRim = 2;                ///< pixels around a void that hold the plate

enum class Cell : std::uint8_t { outside, known, wanted };

/// A void with its rim.
struct Patch {
  int width = 0;
  int height = 0;
  std::vector<Cell> cells;
  std::vector<double> values;

  Patch(int its_width, int its_height)
      : width(its_width), height(its_height), cells(static_cast<std::size_t>(its_width) * static_cast<std::size_t>(its_height), Cell::outside), values(cells.size(), 0.0) {}
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }
};

struct Void {
  std::vector<std::pair<int, int>> pixels;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< the last two are within
};

/// What is known of a pixel while voids are looked for.
enum class Mark : std::uint8_t { none, open, too_large };

/// The void around a pixel; nothing if it is more than `most` wide or high, which stays marked. Of others the marks go.
std::optional<Void> take_void(int x, int y, int width, int height, int most, std::vector<Mark>& marks) {
  Void found{{}, x, y, x, y};
  bool fits = true;
  const auto mark_of = [&](int i, int j) -> Mark& { return marks[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)]; };
  const auto take = [&](int i, int j) {
    Mark& mark = mark_of(i, j);
    if (mark == Mark::too_large) fits = false;
    if (mark != Mark::open) return;
    mark = Mark::none;
    found.pixels.emplace_back(i, j);
  };
  take(x, y);
  for (std::size_t next = 0; next < found.pixels.size() && fits; ++next) {
    const auto [i, j] = found.pixels[next];
    found.left = std::min(found.left, i);
    found.right = std::max(found.right, i);
    found.top = std::min(found.top, j);
    found.bottom = std::max(found.bottom, j);
    for (int b = std::max(j - 1, 0); b <= std::min(j + 1, height - 1); ++b) {
      for (int a = std::max(i - 1, 0); a <= std::min(i + 1, width - 1); ++a) take(a, b);
    }
    fits = fits && found.right - found.left < most && found.bottom - found.top < most;
  }
  if (fits) return found;
  for (const auto& [i, j] : found.pixels) mark_of(i, j) = Mark::too_large;
  return std::nullopt;
}

/// Four times the difference of each cell from its neighbours' mean, free at the edges.
void laplacian(const Patch& patch, const std::vector<double>& values, std::vector<double>& out) {
  std::fill(out.begin(), out.end(), 0.0);
  const auto join = [&](std::size_t a, std::size_t b) {
    if (patch.cells[a] == Cell::outside || patch.cells[b] == Cell::outside) return;
    const double slope = values[b] - values[a];
    out[a] += slope;
    out[b] -= slope;
  };
  for (int y = 0; y < patch.height; ++y) {
    for (int x = 0; x < patch.width; ++x) {
      const std::size_t here = patch.index(x, y);
      if (x + 1 < patch.width) join(here, here + 1);
      if (y + 1 < patch.height) join(here, here + static_cast<std::size_t>(patch.width));
    }
  }
}

/// The forces of plate and tension on the wanted cells.
class Plate {
 public:
  Plate(const Patch& patch, double tension) : patch_(patch), tension_(tension), bent_(patch.cells.size()), twice_(patch.cells.size()) {}

  void forces(const std::vector<double>& values, std::vector<double>& out) {
    laplacian(patch_, values, bent_);
    laplacian(patch_, bent_, twice_);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = patch_.cells[i] == Cell::wanted ? twice_[i] - tension_ * bent_[i] : 0.0;
  }

 private:
  const Patch& patch_;
  double tension_;
  std::vector<double> bent_, twice_;
};

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Conjugate gradients from the values that `patch` has, until the forces are below `least`.
void relax(Patch& patch, double tension, double least) {
  Plate plate(patch, tension);
  std::vector<double> rest(patch.values.size()), moved(patch.values.size());
  plate.forces(patch.values, rest);
  for (double& one : rest) one = -one;
  std::vector<double> direction = rest;
  double size = dot(rest, rest);
  for (int i = 0; i < kMostIterations && size > least * least; ++i) {
    plate.forces(direction, moved);
    const double step = size / dot(direction, moved);
    for (std::size_t j = 0; j < rest.size(); ++j) {
      patch.values[j] += step * direction[j];
      rest[j] -= step * moved[j];
    }
    const double before = std::exchange(size, dot(rest, rest));
    for (std::size_t j = 0; j < rest.size(); ++j) direction[j] = rest[j] + size / before * direction[j];
  }
}

/// Half as fine: known where anything under it is.
Patch coarser(const Patch& fine) {
  Patch coarse((fine.width + 1) / 2, (fine.height + 1) / 2);
  std::vector<int> counts(coarse.cells.size(), 0);
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const std::size_t from = fine.index(x, y), to = coarse.index(x / 2, y / 2);
      if (fine.cells[from] == Cell::known) {
        coarse.values[to] += fine.values[from];
        ++counts[to];
        coarse.cells[to] = Cell::known;
      } else if (fine.cells[from] == Cell::wanted && coarse.cells[to] == Cell::outside) {
        coarse.cells[to] = Cell::wanted;
      }
    }
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) coarse.values[i] /= counts[i];
  }
  return coarse;
}

/// The wanted cells' values from those of a coarser patch, bilinear.
void start_from(const Patch& coarse, Patch& fine) {
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const std::size_t here = fine.index(x, y);
      if (fine.cells[here] != Cell::wanted) continue;
      double sum = 0.0, weights = 0.0;
      for (const int j : {y / 2, y / 2 + (y % 2 == 0 ? -1 : 1)}) {
        for (const int i : {x / 2, x / 2 + (x % 2 == 0 ? -1 : 1)}) {
          if (i < 0 || j < 0 || i >= coarse.width || j >= coarse.height || coarse.cells[coarse.index(i, j)] == Cell::outside) continue;
          const double weight = (i == x / 2 ? 3.0 : 1.0) * (j == y / 2 ? 3.0 : 1.0);
          sum += weight * coarse.values[coarse.index(i, j)];
          weights += weight;
        }
      }
      fine.values[here] = sum / weights;
    }
  }
}

void start_flat(Patch& patch) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < patch.cells.size(); ++i) {
    if (patch.cells[i] != Cell::known) continue;
    sum += patch.values[i];
    ++count;
  }
  for (std::size_t i = 0; i < patch.cells.size(); ++i) {
    if (patch.cells[i] == Cell::wanted) patch.values[i] = sum / count;
  }
}

bool has(const Patch& patch, Cell cell) { return std::find(patch.cells.begin(), patch.cells.end(), cell) != patch.cells.end(); }

void solve(Patch& patch, double tension) {
  if (!has(patch, Cell::wanted)) return;
  start_flat(patch);
  std::vector<double> flat(patch.values.size());
  Plate(patch, tension).forces(patch.values, flat);
  if (std::max(patch.width, patch.height) > 8) {
    Patch coarse = coarser(patch);
    solve(coarse, 4.0 * tension);
    start_from(coarse, patch);
  }
  relax(patch, tension, kAccuracy * std::max(std::sqrt(dot(flat, flat)), kLeastForce));
}

void fill(const Plane& window, const Void& found, Plane& filled) {
  const int left = std::max(found.left - kRim, 0), top = std::max(found.top - kRim, 0);
  Patch patch(std::min(found.right + kRim, window.width - 1) - left + 1, std::min(found.bottom + kRim, window.height - 1) - top + 1);
  for (int y = 0; y < patch.height; ++y) {
    for (int x = 0; x < patch.width; ++x) {
      const float value = window.at(left + x, top + y);
      if (std::isnan(value)) continue;
      patch.cells[patch.index(x, y)] = Cell::known;
      patch.values[patch.index(x, y)] = static_cast<double>(value);
    }
  }
  for (const auto& [x, y] : found.pixels) patch.cells[patch.index(x - left, y - top)] = Cell::wanted;
  if (!has(patch, Cell::known)) return;
  solve(patch, kTension);
  for (const auto& [x, y] : found.pixels) filled.at(x, y) = static_cast<float>(patch.values[patch.index(x - left, y - top)]);
}

}  // namespace

void fill_voids(Plane& window, const PixelBox& wanted, int most_pixels) {
  std::vector<Mark> marks(window.values.size());
  std::transform(window.values.begin(), window.values.end(), marks.begin(), [](float value) { return std::isnan(value) ? Mark::open : Mark::none; });
  const Plane before = window;
  for (int y = wanted.y; y < wanted.y + wanted.height; ++y) {
    for (int x = wanted.x; x < wanted.x + wanted.width; ++x) {
      if (marks[static_cast<std::size_t>(y) * static_cast<std::size_t>(window.width) + static_cast<std::size_t>(x)] != Mark::open) continue;
      if (const std::optional<Void> found = take_void(x, y, window.width, window.height, most_pixels, marks)) fill(before, *found, window);
    }
  }
}

}  // namespace tellurion::prepare
