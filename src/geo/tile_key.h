// Names of the surface tiles: a cube of six quadtrees over the geodetic normal, with equi-angular faces.
// Thread-safe: pure functions.
//
// A face is spanned by (u, v) in [-1, 1]^2; the normal there is normalize(out + tan(u pi/4) right + tan(v pi/4) down).
// Faces 0..3 look to longitude 0, 90, 180, -90 with u to the east and v to the south; face 4 is the north pole, face 5
// the south pole, with u to the east seen from face 0 and v away from the north as face 0 continues. Row 0 is the
// lowest v.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "geo/frames.h"
#include "geo/geodetic.h"

namespace tellurion::geo {

inline constexpr int kFaceCount = 6;
inline constexpr int kMaxTileLevel = 28;  ///< tiles of 4 cm on Earth

/// The sides of a tile, in the order of the neighbours.
enum class Side : std::uint8_t { north = 0, east = 1, south = 2, west = 3 };  // v-, u+, v+, u-

/// One tile of the cube: column `x` grows with u, row `y` with v, both in [0, 2^level).
struct TileKey {
  std::uint8_t face = 0;
  std::uint8_t level = 0;
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  friend constexpr auto operator<=>(const TileKey&, const TileKey&) = default;
};

constexpr bool is_valid(const TileKey& k) {
  return k.face < kFaceCount && k.level <= kMaxTileLevel && k.x < (1u << k.level) && k.y < (1u << k.level);
}

/// Requires level > 0.
constexpr TileKey parent(const TileKey& k) {
  return {k.face, static_cast<std::uint8_t>(k.level - 1), k.x >> 1, k.y >> 1};
}
/// Child `index` in 0..3: bit 0 is the column, bit 1 the row. Requires level < kMaxTileLevel.
constexpr TileKey child(const TileKey& k, int index) {
  return {k.face, static_cast<std::uint8_t>(k.level + 1), k.x * 2 + static_cast<std::uint32_t>(index & 1),
          k.y * 2 + static_cast<std::uint32_t>(index >> 1)};
}
/// Which child of its parent `k` is.
constexpr int child_index(const TileKey& k) { return static_cast<int>((k.x & 1u) | ((k.y & 1u) << 1)); }
/// The ancestor at `level` <= k.level (the tile itself if equal).
constexpr TileKey ancestor(const TileKey& k, int level) {
  const int up = k.level - level;
  return {k.face, static_cast<std::uint8_t>(level), k.x >> up, k.y >> up};
}
/// Whether `outer` is `inner` or one of its ancestors.
constexpr bool contains(const TileKey& outer, const TileKey& inner) {
  return outer.face == inner.face && outer.level <= inner.level && ancestor(inner, outer.level) == outer;
}

/// The tile of the same level on the other side of `side`, over the faces' seams too.
TileKey neighbour(const TileKey& key, Side side);

/// Square of a face: lower and upper (u, v), each in [-1, 1].
struct FaceRect {
  glm::dvec2 lower;
  glm::dvec2 upper;
};
FaceRect face_rect(const TileKey& key);

/// Unit normal at face coordinates; also defined a little outside of [-1, 1] (|u|, |v| < 2), as the face's
/// continuation.
Vector<Ecef> face_normal(int face, glm::dvec2 uv);

/// Unit normal at tile coordinates `st`: (0, 0) is the corner of lowest u and v, (1, 1) the opposite one. May lie
/// outside.
Vector<Ecef> tile_normal(const TileKey& key, glm::dvec2 st);

/// The face on which `normal` lies and its coordinates there, each in [-1, 1]. On an edge the face of lowest number.
struct FacePoint {
  int face = 0;
  glm::dvec2 uv{0.0};
};
FacePoint face_point(const Vector<Ecef>& normal);

/// Coordinates of `normal` on a given face; nothing if it lies 90 degrees or more away from the face's middle.
std::optional<glm::dvec2> project_to_face(int face, const Vector<Ecef>& normal);

/// The tile of `level` that holds `normal`.
TileKey tile_at(const Vector<Ecef>& normal, int level);

/// Angle that a tile of `level` subtends along a side through its face's middle: (pi/2) / 2^level.
Radians tile_angle(int level);

/// The smallest range of latitudes and longitudes that holds the tile. `west` <= `east`, `east` may pass pi;
/// a tile that holds a pole has the full circle of longitudes.
struct GeodeticBounds {
  Radians south, north, west, east;
};
GeodeticBounds geodetic_bounds(const TileKey& key);

/// `face/level/x/y`, as written by the programs.
std::string to_string(const TileKey& key);
/// Errors: invalid_argument, naming the text. Accepts exactly what to_string writes.
Result<TileKey> parse_tile_key(std::string_view text);

}  // namespace tellurion::geo

template <>
struct std::hash<tellurion::geo::TileKey> {
  std::size_t operator()(const tellurion::geo::TileKey& k) const noexcept {
    std::uint64_t h = (std::uint64_t{k.x} << 32) | k.y;
    h ^= (std::uint64_t{k.face} << 59) ^ (std::uint64_t{k.level} << 52);
    h ^= h >> 31;
    h *= 0x7fb5d329728ea185ull;
    h ^= h >> 27;
    h *= 0x81dadef4bc2dd44dull;
    return static_cast<std::size_t>(h ^ (h >> 33));
  }
};
