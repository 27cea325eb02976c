#include "source/grid_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>

namespace tellurion::source {
namespace {

constexpr int kCells = 32;        ///< a side
constexpr int kStepsPerCell = 4;  ///< places a cell and axis, less one
constexpr int kSide = kCells * kStepsPerCell + 1;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

/// A cell that takes more of a face than this has places too far apart to tell how it bends: it counts as the whole face.
constexpr double kWildSpan = 0.9;

bool is_valid(const geo::LatLon& place) { return std::isfinite(place.latitude.value) && std::isfinite(place.longitude.value); }

bool overlap(const geo::FaceRect& a, const geo::FaceRect& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y && b.lower.y <= a.upper.y;
}

void grow(geo::FaceRect& rect, glm::dvec2 point) {
  rect.lower = glm::min(rect.lower, point);
  rect.upper = glm::max(rect.upper, point);
}

geo::FaceRect nothing() { return {glm::dvec2(kInfinity), glm::dvec2(-kInfinity)}; }

/// The lattice of a raster's places as normals and as points of its world.
struct Lattice {
  std::vector<geo::LatLon> places;
  std::vector<geo::Vector<geo::Ecef>> normals;
  std::vector<glm::dvec3> points;
  glm::dvec2 pixels_per_step{0.0};

  static std::size_t index(int x, int y) { return static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x); }
};

Lattice make_lattice(const PixelRange& range, const geo::Ellipsoid& world, const ToPlaces& to_places) {
  Lattice lattice;
  lattice.pixels_per_step = (range.upper - range.lower) / static_cast<double>(kSide - 1);
  std::vector<glm::dvec2> pixels;
  pixels.reserve(kSide * kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) pixels.push_back(glm::mix(range.lower, range.upper, glm::dvec2(x, y) / static_cast<double>(kSide - 1)));
  }
  lattice.places.resize(pixels.size());
  to_places(pixels, lattice.places);
  lattice.normals.resize(pixels.size());
  lattice.points.resize(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_valid(lattice.places[i])) continue;
    lattice.normals[i] = geo::normal_at(lattice.places[i]);
    lattice.points[i] = geo::surface_point(world, lattice.normals[i]).xyz;
  }
  return lattice;
}

/// The finest spacing of samples in the cell at (column, row), larger axis.
double finest_spacing(const Lattice& lattice, int column, int row) {
  double finest = kInfinity;
  for (int y = row * kStepsPerCell; y < (row + 1) * kStepsPerCell; ++y) {
    for (int x = column * kStepsPerCell; x < (column + 1) * kStepsPerCell; ++x) {
      const std::size_t here = Lattice::index(x, y);
      const std::size_t right = Lattice::index(x + 1, y);
      const std::size_t below = Lattice::index(x, y + 1);
      if (!is_valid(lattice.places[here]) || !is_valid(lattice.places[right]) || !is_valid(lattice.places[below])) continue;
      const double along_x = glm::distance(lattice.points[here], lattice.points[right]) / lattice.pixels_per_step.x;
      const double along_y = glm::distance(lattice.points[here], lattice.points[below]) / lattice.pixels_per_step.y;
      finest = std::min(finest, std::max(along_x, along_y));
    }
  }
  return finest;
}

/// The rectangle that the cell takes on `face`; nothing if it misses the face.
std::optional<geo::FaceRect> rect_on_face(const Lattice& lattice, int column, int row, int face) {
  std::array<std::array<std::optional<glm::dvec2>, kStepsPerCell + 1>, kStepsPerCell + 1> at;
  geo::FaceRect rect = nothing();
  bool complete = true;
  for (std::size_t y = 0; y <= kStepsPerCell; ++y) {
    for (std::size_t x = 0; x <= kStepsPerCell; ++x) {
      const std::size_t i = Lattice::index(column * kStepsPerCell + static_cast<int>(x), row * kStepsPerCell + static_cast<int>(y));
      if (is_valid(lattice.places[i])) at[y][x] = geo::project_to_face(face, lattice.normals[i]);
      if (at[y][x]) {
        grow(rect, *at[y][x]);
      } else {
        complete = false;
      }
    }
  }
  if (rect.lower.x > rect.upper.x) return std::nullopt;

  // Between places a curve leaves the rectangle by an eighth of its second difference; a quarter over the middle of a cell.
  glm::dvec2 margin(1e-12);
  for (std::size_t y = 0; y <= kStepsPerCell; ++y) {
    for (std::size_t x = 0; x <= kStepsPerCell; ++x) {
      if (x >= 2 && at[y][x] && at[y][x - 1] && at[y][x - 2]) {
        margin = glm::max(margin, 0.5 * glm::abs(*at[y][x] - 2.0 * *at[y][x - 1] + *at[y][x - 2]));
      }
      if (y >= 2 && at[y][x] && at[y - 1][x] && at[y - 2][x]) {
        margin = glm::max(margin, 0.5 * glm::abs(*at[y][x] - 2.0 * *at[y - 1][x] + *at[y - 2][x]));
      }
    }
  }
  if (!complete) margin += rect.upper - rect.lower + glm::dvec2(0.01);  // the raster ends somewhere within the cell
  rect.lower -= margin;
  rect.upper += margin;
  const geo::FaceRect whole{glm::dvec2(-1.0), glm::dvec2(1.0)};
  if (!overlap(rect, whole)) return std::nullopt;
  const glm::dvec2 span = rect.upper - rect.lower;
  return std::max(span.x, span.y) > kWildSpan ? whole : rect;
}

}  // namespace

GridCoverage::GridCoverage(const PixelRange& range, const geo::Ellipsoid& world, const ToPlaces& to_places) {
  for (Face& face : faces_) face.rect = nothing();
  const Lattice lattice = make_lattice(range, world, to_places);
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const double spacing = finest_spacing(lattice, column, row);
      for (int face = 0; face < geo::kFaceCount; ++face) {
        if (const std::optional<geo::FaceRect> rect = rect_on_face(lattice, column, row, face)) add(face, {*rect, spacing});
      }
    }
  }
}

void GridCoverage::add(int face, const Cell& cell) {
  Face& on = faces_[static_cast<std::size_t>(face)];
  grow(on.rect, cell.rect.lower);
  grow(on.rect, cell.rect.upper);
  on.cells.push_back(cell);
}

bool GridCoverage::touches(const geo::TileKey& tile) const {
  const geo::FaceRect rect = geo::face_rect(tile);
  const Face& face = faces_[tile.face];
  return overlap(rect, face.rect) &&
         std::any_of(face.cells.begin(), face.cells.end(), [&](const Cell& cell) { return overlap(rect, cell.rect); });
}

Metres GridCoverage::spacing_under(const geo::TileKey& tile) const {
  const geo::FaceRect rect = geo::face_rect(tile);
  const Face& face = faces_[tile.face];
  double finest = kInfinity;
  if (!overlap(rect, face.rect)) return Metres(finest);
  for (const Cell& cell : face.cells) {
    if (overlap(rect, cell.rect)) finest = std::min(finest, cell.spacing);
  }
  return Metres(finest);
}

namespace {

/// Whether columns and rows at the middle of the upper edge turn as on a map with the south below; false where a raster is mirrored.
bool is_upright(const PixelRange& range, const ToPlaces& to_places) {
  const glm::dvec2 step = (range.upper - range.lower) * 1e-3;
  const glm::dvec2 middle(0.5 * (range.lower.x + range.upper.x), range.lower.y);
  const std::array<glm::dvec2, 3> pixels{middle, middle + glm::dvec2(step.x, 0.0), middle + glm::dvec2(0.0, step.y)};
  std::array<geo::LatLon, 3> places;
  to_places(pixels, places);
  const glm::dvec3 here = geo::normal_at(places[0]).xyz;
  return glm::dot(here, glm::cross(geo::normal_at(places[1]).xyz - here, geo::normal_at(places[2]).xyz - here)) < 0.0;
}

}  // namespace

geo::GeodeticBounds bounds_of(const PixelRange& range, const ToPlaces& to_places) {
  constexpr int kStepsPerEdge = 256;
  const std::array<glm::dvec2, 5> corners{range.lower, glm::dvec2(range.upper.x, range.lower.y), range.upper,
                                          glm::dvec2(range.lower.x, range.upper.y), range.lower};
  std::vector<glm::dvec2> pixels;
  for (std::size_t edge = 0; edge < 4; ++edge) {
    for (int i = 0; i < kStepsPerEdge; ++i) pixels.push_back(glm::mix(corners[edge], corners[edge + 1], static_cast<double>(i) / kStepsPerEdge));
  }
  pixels.push_back(corners[0]);
  std::vector<geo::LatLon> outline(pixels.size());
  to_places(pixels, outline);

  const bool complete = std::all_of(outline.begin(), outline.end(), is_valid);
  if (!complete) {  // the raster is larger than its projection: take places all over it
    pixels.clear();
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) pixels.push_back(glm::mix(range.lower, range.upper, glm::dvec2(x, y) / static_cast<double>(kSide - 1)));
    }
    outline.resize(pixels.size());
    to_places(pixels, outline);
    std::erase_if(outline, [](const geo::LatLon& place) { return !is_valid(place); });
    if (outline.empty()) return {Radians(0), Radians(0), Radians(0), Radians(0)};
  }

  double south = kInfinity, north = -kInfinity, west = kInfinity, east = -kInfinity;
  double longitude = outline.front().longitude.value;
  for (const geo::LatLon& place : outline) {
    south = std::min(south, place.latitude.value);
    north = std::max(north, place.latitude.value);
    const double step = place.longitude.value - longitude;
    longitude += step - 2.0 * kPi * std::round(step / (2.0 * kPi));  // continues without jumps
    west = std::min(west, longitude);
    east = std::max(east, longitude);
  }
  const bool round_a_pole = complete && std::abs(longitude - outline.front().longitude.value) > kPi;
  if (round_a_pole) {
    // The outline goes with the clock, seen from above: round the north pole that is to the west.
    const bool westward = longitude < outline.front().longitude.value;
    if (westward == is_upright(range, to_places)) {
      north = kPi / 2;
    } else {
      south = -kPi / 2;
    }
  }
  if (!complete || round_a_pole || east - west > 2.0 * kPi - 1e-9) return {Radians(south), Radians(north), Radians(-kPi), Radians(kPi)};
  const double turn = 2.0 * kPi * std::floor((west + kPi) / (2.0 * kPi));
  return {Radians(south), Radians(north), Radians(west - turn), Radians(east - turn)};
}

Metres spacing_at(glm::dvec2 pixel, const geo::Ellipsoid& world, const ToPlaces& to_places) {
  const std::array<glm::dvec2, 4> pixels{pixel - glm::dvec2(0.5, 0), pixel + glm::dvec2(0.5, 0), pixel - glm::dvec2(0, 0.5),
                                         pixel + glm::dvec2(0, 0.5)};
  std::array<geo::LatLon, 4> places;
  to_places(pixels, places);
  std::array<glm::dvec3, 4> points{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (!is_valid(places[i])) return Metres(kInfinity);
    points[i] = geo::surface_point(world, geo::normal_at(places[i])).xyz;
  }
  return Metres(std::max(glm::distance(points[0], points[1]), glm::distance(points[2], points[3])));
}

}  // namespace tellurion::source
