#include "geo/tile_key.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>

namespace tellurion::geo {
namespace {

constexpr double kQuarterPi = std::numbers::pi / 4.0;

/// Directions of a face: each is plus or minus an axis of ECEF, so products with them are exact.
struct FaceAxes {
  glm::dvec3 out;
  glm::dvec3 right;  ///< of growing u
  glm::dvec3 down;   ///< of growing v
};

constexpr FaceAxes kFaces[kFaceCount] = {
    {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}},    //
    {{0, 1, 0}, {-1, 0, 0}, {0, 0, -1}},   //
    {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}},  //
    {{0, -1, 0}, {1, 0, 0}, {0, 0, -1}},   //
    {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},     //
    {{0, 0, -1}, {0, 1, 0}, {-1, 0, 0}},
};

std::uint8_t face_towards(const glm::dvec3& out) {
  std::uint8_t face = 0;
  while (face < kFaceCount && kFaces[face].out != out) ++face;
  assert(face < kFaceCount);
  return face;
}

/// Face coordinate to slope, exact at the borders, where two faces must agree to the bit.
double slope_of(double u) { return std::abs(u) == 1.0 ? u : std::tan(u * kQuarterPi); }
double coordinate_of(double slope) { return std::abs(slope) == 1.0 ? slope : std::atan(slope) / kQuarterPi; }

/// Smallest and largest distance of [lower, upper] from 0.
struct Distances {
  double least;
  double most;
};
Distances distances_from_zero(double lower, double upper) {
  return {std::max({0.0, lower, -upper}), std::max(std::abs(lower), std::abs(upper))};
}

Radians latitude_of(double sine_side, double cosine_side) { return Radians(std::atan2(sine_side, cosine_side)); }

/// Bounds on a face of the equator: longitude is linear in u; latitude is atan(-Y / sqrt(1 + X^2)) with slopes X, Y.
GeodeticBounds equatorial_bounds(int face, const FaceRect& rect) {
  const Distances x = distances_from_zero(slope_of(rect.lower.x), slope_of(rect.upper.x));
  const double north = -slope_of(rect.lower.y);
  const double south = -slope_of(rect.upper.y);
  // Along a parallel of the face, latitude is farthest from the equator where |X| is least.
  const auto latitude = [](double y, double abs_x) { return latitude_of(y, std::sqrt(1.0 + abs_x * abs_x)); };
  // The middle's longitude in quarters of pi; the same tile lies west of pi or east of -pi, not both.
  double middle = 2.0 * face;
  if (middle + rect.lower.x >= 4.0) middle -= 8.0;
  return {latitude(south, south >= 0.0 ? x.most : x.least), latitude(north, north >= 0.0 ? x.least : x.most),
          Radians((middle + rect.lower.x) * kQuarterPi), Radians((middle + rect.upper.x) * kQuarterPi)};
}

/// Bounds on the face of a pole: the angle from the pole is atan(hypot(X, Y)).
GeodeticBounds polar_bounds(int face, const FaceRect& rect) {
  const glm::dvec2 lower(slope_of(rect.lower.x), slope_of(rect.lower.y));
  const glm::dvec2 upper(slope_of(rect.upper.x), slope_of(rect.upper.y));
  const Distances x = distances_from_zero(lower.x, upper.x);
  const Distances y = distances_from_zero(lower.y, upper.y);
  Radians low = latitude_of(1.0, std::hypot(x.most, y.most));
  Radians high = latitude_of(1.0, std::hypot(x.least, y.least));
  if (face == 5) {
    std::swap(low, high);
    low = -low;
    high = -high;
  }
  if (x.least == 0.0 && y.least == 0.0) {
    return {low, high, Radians(-std::numbers::pi), Radians(std::numbers::pi)};
  }
  const auto longitude_at = [&](double slope_x, double slope_y) {
    const FaceAxes& axes = kFaces[face];
    const glm::dvec3 p = axes.right * slope_x + axes.down * slope_y;
    return std::atan2(p.y, p.x);
  };
  // Seen from the pole, a square beside it spans at most half a turn, between two of its corners.
  const double middle = longitude_at(lower.x + upper.x, lower.y + upper.y);
  double west = 0.0;
  double east = 0.0;
  for (const double corner_x : {lower.x, upper.x}) {
    for (const double corner_y : {lower.y, upper.y}) {
      const double turn = std::remainder(longitude_at(corner_x, corner_y) - middle, 2.0 * std::numbers::pi);
      west = std::min(west, turn);
      east = std::max(east, turn);
    }
  }
  west += middle;
  east += middle;
  const double shift = west < -std::numbers::pi ? 2.0 * std::numbers::pi : 0.0;
  return {low, high, Radians(west + shift), Radians(east + shift)};
}

}  // namespace

TileKey neighbour(const TileKey& key, Side side) {
  assert(is_valid(key));
  const std::uint32_t last = (1u << key.level) - 1;
  TileKey beside = key;
  glm::dvec2 step(0.0);
  switch (side) {
    case Side::north:
      if (key.y > 0) return --beside.y, beside;
      step.y = -1.0;
      break;
    case Side::east:
      if (key.x < last) return ++beside.x, beside;
      step.x = 1.0;
      break;
    case Side::south:
      if (key.y < last) return ++beside.y, beside;
      step.y = 1.0;
      break;
    case Side::west:
      if (key.x > 0) return --beside.x, beside;
      step.x = -1.0;
      break;
  }
  // Over the edge of a cube whose half side counts `half` half cells (exact in doubles): the neighbour's middle lies on
  // the face that we step onto, half a cell below the face that we leave.
  const double half = std::ldexp(1.0, key.level);
  const FaceAxes& from = kFaces[key.face];
  const glm::dvec3 outward = from.right * step.x + from.down * step.y;
  const glm::dvec3 along =
      step.x != 0.0 ? from.down * (2.0 * key.y + 1.0 - half) : from.right * (2.0 * key.x + 1.0 - half);
  const glm::dvec3 middle = outward * half + from.out * (half - 1.0) + along;
  beside.face = face_towards(outward);
  const FaceAxes& to = kFaces[beside.face];
  beside.x = static_cast<std::uint32_t>((glm::dot(middle, to.right) + half - 1.0) / 2.0);
  beside.y = static_cast<std::uint32_t>((glm::dot(middle, to.down) + half - 1.0) / 2.0);
  return beside;
}

FaceRect face_rect(const TileKey& key) {
  const double size = std::ldexp(2.0, -key.level);
  const glm::dvec2 lower(key.x * size - 1.0, key.y * size - 1.0);
  return {lower, lower + size};
}

Vector<Ecef> face_normal(int face, glm::dvec2 uv) {
  assert(face >= 0 && face < kFaceCount && std::abs(uv.x) < 2.0 && std::abs(uv.y) < 2.0);
  const FaceAxes& axes = kFaces[face];
  const glm::dvec3 on_cube = axes.out + axes.right * slope_of(uv.x) + axes.down * slope_of(uv.y);
  // Division, with the sum in the order of the ECEF axes: the same bits from either side of an edge.
  return {on_cube / std::sqrt(on_cube.x * on_cube.x + on_cube.y * on_cube.y + on_cube.z * on_cube.z)};
}

Vector<Ecef> tile_normal(const TileKey& key, glm::dvec2 st) {
  // Sizes are powers of two and columns have 28 bits: exact for `st` of up to 24 fractional bits.
  const double size = std::ldexp(2.0, -key.level);
  return face_normal(key.face, {(key.x + st.x) * size - 1.0, (key.y + st.y) * size - 1.0});
}

FacePoint face_point(const Vector<Ecef>& normal) {
  int face = 0;
  for (int i = 1; i < kFaceCount; ++i) {
    if (glm::dot(normal.xyz, kFaces[i].out) > glm::dot(normal.xyz, kFaces[face].out)) face = i;
  }
  return {face, *project_to_face(face, normal)};
}

std::optional<glm::dvec2> project_to_face(int face, const Vector<Ecef>& normal) {
  assert(face >= 0 && face < kFaceCount);
  const FaceAxes& axes = kFaces[face];
  const double out = glm::dot(normal.xyz, axes.out);
  if (!(out > 0.0)) return std::nullopt;
  return glm::dvec2(coordinate_of(glm::dot(normal.xyz, axes.right) / out),
                    coordinate_of(glm::dot(normal.xyz, axes.down) / out));
}

TileKey tile_at(const Vector<Ecef>& normal, int level) {
  assert(level >= 0 && level <= kMaxTileLevel);
  const FacePoint point = face_point(normal);
  const double count = std::ldexp(1.0, level);
  const auto cell = [&](double u) {
    return static_cast<std::uint32_t>(std::clamp((u + 1.0) * 0.5 * count, 0.0, count - 1.0));
  };
  return {static_cast<std::uint8_t>(point.face), static_cast<std::uint8_t>(level), cell(point.uv.x), cell(point.uv.y)};
}

Radians tile_angle(int level) { return Radians(std::ldexp(std::numbers::pi / 2.0, -level)); }

GeodeticBounds geodetic_bounds(const TileKey& key) {
  assert(is_valid(key));
  const FaceRect rect = face_rect(key);
  return key.face < 4 ? equatorial_bounds(key.face, rect) : polar_bounds(key.face, rect);
}

std::string to_string(const TileKey& key) {
  return std::to_string(int{key.face}) + '/' + std::to_string(int{key.level}) + '/' + std::to_string(key.x) + '/' +
         std::to_string(key.y);
}

Result<TileKey> parse_tile_key(std::string_view text) {
  const auto fail = [&] {
    return Error{ErrorCode::invalid_argument,
                 "no tile key: '" + std::string(text.substr(0, 80)) + "' (wanted: face/level/x/y, as in 4/3/7/0)"};
  };
  std::array<std::uint32_t, 4> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && (at == end || *at++ != '/')) return fail();
    const auto [next, error] = std::from_chars(at, end, numbers[i]);
    if (error != std::errc{} || (*at == '0' && next - at > 1)) return fail();
    at = next;
  }
  if (at != end || numbers[0] > 255 || numbers[1] > 255) return fail();
  const TileKey key{static_cast<std::uint8_t>(numbers[0]), static_cast<std::uint8_t>(numbers[1]), numbers[2],
                    numbers[3]};
  if (!is_valid(key)) return fail();
  return key;
}

}  // namespace tellurion::geo
