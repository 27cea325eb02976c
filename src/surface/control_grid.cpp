#include "surface/control_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "surface/tile_content.h"
#include "surface/tile_grid.h"

namespace tellurion::surface {
namespace {

constexpr double kTileTexels = kColourSlotSide - 2 * kColourGutter;
constexpr int kLeastCellTexels = 4;
constexpr int kDeepest = 3;  ///< squares of 32 texels

/// Share of a nominal texel that interpolated places may be off: a third of the smallest texel of a level (0.7 nominal).
constexpr double kTolerance = 0.23;

int square_texels(int depth) { return kColourSlotSide >> depth; }

bool is_finite(const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// Tile coordinate at `i` squares from the slot's border.
double slot_coordinate(double i, int depth) {
  return (std::ldexp(kColourSlotSide * i, -depth) - kColourGutter) / kTileTexels;
}

class Mapper {
 public:
  Mapper(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key, const source::RasterDescription& raster,
         source::RasterReader& reader)
      : key_(key),
        wraps_(raster.wraps),
        size_(raster.levels.front().width, raster.levels.front().height),
        reader_(reader),
        tolerance_(kTolerance * nominal_colour_texel(ellipsoid, key.level) / ellipsoid.a()) {}

  SlotMapping run() {
    map_square({});
    return std::move(out_);
  }

 private:
  /// The points of a square's cells, their edges' and their own middles: (2 cells + 1)^2.
  struct Points {
    int cells = 0;
    int side = 0;
    std::vector<geo::Vector<geo::Ecef>> normals;
    std::vector<glm::dvec2> pixels;
    std::size_t at(int x, int y) const {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x);
    }
  };

  void map_square(const SlotSquare& square) {
    int cells = std::max(2, (key_.level == 0 ? 32 : 16) >> square.depth);
    for (;;) {
      const Points points = sample(square, cells);
      std::optional<ControlGrid> grid = touching_part(square, points);
      if (!grid) return;
      const bool projectable = std::all_of(grid->pixels.begin(), grid->pixels.end(), is_finite);
      const double worst = projectable ? worst_error(points) / tolerance_ : INFINITY;
      if (worst <= 1.0) return keep(square, points, std::move(*grid));
      // Halving cells takes away three quarters of the error, except round a singularity: that is to be cut out.
      const int finer = cells * (worst <= 4.0 ? 2 : 4);
      if (worst <= 16.0 && square_texels(square.depth) / finer >= kLeastCellTexels) {
        cells = finer;
      } else if (square.depth < kDeepest) {
        for (int i = 0; i < 4; ++i) map_square({square.depth + 1, 2 * square.column + (i & 1), 2 * square.row + (i >> 1)});
        return;
      } else {
        grid->follows = false;
        return keep(square, points, std::move(*grid));
      }
    }
  }

  /// The cells that hold some of the raster.
  std::optional<ControlGrid> touching_part(const SlotSquare& square, const Points& points) const {
    glm::ivec2 first(points.cells), last(-1);
    for (int row = 0; row < points.cells; ++row) {
      for (int column = 0; column < points.cells; ++column) {
        if (!touches_raster(points, column, row)) continue;
        first = glm::min(first, glm::ivec2(column, row));
        last = glm::max(last, glm::ivec2(column, row));
      }
    }
    if (last.x < 0) return std::nullopt;
    const auto along = [&](int column, int row) {
      return glm::dvec2(slot_coordinate(square.column + static_cast<double>(column) / points.cells, square.depth),
                        slot_coordinate(square.row + static_cast<double>(row) / points.cells, square.depth));
    };
    ControlGrid grid;
    grid.lower = along(first.x, first.y);
    grid.upper = along(last.x + 1, last.y + 1);
    grid.columns = last.x + 1 - first.x;
    grid.rows = last.y + 1 - first.y;
    grid.cell_texels = square_texels(square.depth) / points.cells;
    for (int row = first.y; row <= last.y + 1; ++row) {
      for (int column = first.x; column <= last.x + 1; ++column) {
        grid.pixels.push_back(points.pixels[points.at(2 * column, 2 * row)]);
      }
    }
    grid.pixels_per_texel = median_step(grid) / static_cast<double>(grid.cell_texels);
    return grid;
  }

  void keep(const SlotSquare& square, const Points& points, ControlGrid grid) {
    covered_ += std::ldexp(static_cast<double>(grid.columns * grid.rows) / (points.cells * points.cells), -2 * square.depth);
    out_.whole = covered_ == 1.0;  // sums of powers of two: exact
    out_.grids.push_back(std::move(grid));
  }

  Points sample(const SlotSquare& square, int cells) {
    Points points;
    points.cells = cells;
    points.side = 2 * points.cells + 1;
    const auto along = [&](int i, int start) {
      return slot_coordinate(start + static_cast<double>(i) / (points.side - 1), square.depth);
    };
    points.normals.reserve(static_cast<std::size_t>(points.side) * static_cast<std::size_t>(points.side));
    for (int y = 0; y < points.side; ++y) {
      for (int x = 0; x < points.side; ++x) {
        points.normals.push_back(geo::tile_normal(key_, {along(x, square.column), along(y, square.row)}));
      }
    }
    places_.resize(points.normals.size());
    points.pixels.resize(points.normals.size());
    std::transform(points.normals.begin(), points.normals.end(), places_.begin(), geo::place_of_normal);
    reader_.to_pixels(places_, points.pixels);
    if (wraps_) unwrap(points);
    return points;
  }

  /// Brings every point to within half a turn of the one before it.
  void unwrap(Points& points) const {
    for (int y = 0; y < points.side; ++y) {
      for (int x = 0; x < points.side; ++x) {
        if (x == 0 && y == 0) continue;
        const double before = points.pixels[x > 0 ? points.at(x - 1, y) : points.at(0, y - 1)].x;
        double& here = points.pixels[points.at(x, y)].x;
        here -= size_.x * std::round((here - before) / size_.x);
      }
    }
  }

  /// Whether a cell may hold some of the raster; NaN corners mean it may.
  bool touches_raster(const Points& points, int column, int row) const {
    glm::dvec2 low(INFINITY), high(-INFINITY);
    int known = 0;
    for (int y = 2 * row; y <= 2 * row + 2; ++y) {
      for (int x = 2 * column; x <= 2 * column + 2; ++x) {
        const glm::dvec2 pixel = points.pixels[points.at(x, y)];
        if (!is_finite(pixel)) continue;
        low = glm::min(low, pixel);
        high = glm::max(high, pixel);
        ++known;
      }
    }
    if (known == 0) return false;
    const glm::dvec2 spare = known == 9 ? 0.25 * (high - low) : size_;  // cells' sides are bent
    low -= spare;
    high += spare;
    const bool in_x = wraps_ || (high.x > 0.0 && low.x < size_.x);
    return in_x && high.y > 0.0 && low.y < size_.y;
  }

  /// How far bilinear interpolation between the cells' corners leads from the right places, radians; infinite if to none.
  double worst_error(const Points& points) {
    checked_pixels_.clear();
    checked_normals_.clear();
    for (int y = 0; y < points.side; ++y) {
      for (int x = 0; x < points.side; ++x) {
        if ((x & 1) == 0 && (y & 1) == 0) continue;
        const int column = std::min(x / 2, points.cells - 1), row = std::min(y / 2, points.cells - 1);
        if (!touches_raster(points, column, row)) continue;
        const int dx = x & 1, dy = y & 1;
        glm::dvec2 mean = (points.pixels[points.at(x - dx, y - dy)] + points.pixels[points.at(x + dx, y - dy)] +
                           points.pixels[points.at(x - dx, y + dy)] + points.pixels[points.at(x + dx, y + dy)]) / 4.0;
        if (wraps_) mean.x -= size_.x * std::floor(mean.x / size_.x);
        checked_pixels_.push_back(mean);
        checked_normals_.push_back(points.normals[points.at(x, y)]);
      }
    }
    places_.resize(checked_pixels_.size());
    reader_.to_places(checked_pixels_, places_);
    double worst = 0.0;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const double off = glm::distance(geo::normal_at(places_[i]).xyz, checked_normals_[i].xyz);
      if (!(off <= worst)) worst = std::isfinite(off) ? off : INFINITY;
    }
    return worst;
  }

  /// Source columns and rows along a step of a cell, in the direction in which each grows fastest.
  static glm::dvec2 median_step(const ControlGrid& grid) {
    std::vector<double> columns, rows;
    const auto at = [&](int x, int y) { return grid.pixels[static_cast<std::size_t>(y * (grid.columns + 1) + x)]; };
    for (int y = 0; y < grid.rows; ++y) {
      for (int x = 0; x < grid.columns; ++x) {
        const glm::dvec2 here = at(x, y), ds = at(x + 1, y) - here, dt = at(x, y + 1) - here;
        if (!is_finite(ds) || !is_finite(dt)) continue;
        columns.push_back(std::hypot(ds.x, dt.x));
        rows.push_back(std::hypot(ds.y, dt.y));
      }
    }
    if (columns.empty()) return glm::dvec2(1.0);
    const auto median = [](std::vector<double>& values) {
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      return *middle;
    };
    return {median(columns), median(rows)};
  }

  geo::TileKey key_;
  bool wraps_;
  glm::dvec2 size_;
  source::RasterReader& reader_;
  double tolerance_;  ///< radians
  SlotMapping out_;
  double covered_ = 0.0;
  std::vector<geo::LatLon> places_;
  std::vector<glm::dvec2> checked_pixels_;
  std::vector<geo::Vector<geo::Ecef>> checked_normals_;
};

}  // namespace

SlotMapping map_slot(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key, const source::RasterDescription& raster,
                     source::RasterReader& reader) {
  return Mapper(ellipsoid, key, raster, reader).run();
}

}  // namespace tellurion::surface
