// The two schemes in which the world serves its map tiles: geographic and Web Mercator.
// Thread-safe: pure functions. Column 0 begins at longitude -180; row 0 is the northernmost (TMS counts from the
// south). Web Mercator: OGC 17-083r4 (WebMercatorQuad); geographic: the same, WorldCRS84Quad. Angles are geodetic.
#pragma once

#include <compare>
#include <cstdint>
#include <glm/vec2.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "base/quantity.h"
#include "base/result.h"
#include "geo/geodetic.h"
#include "geo/tile_key.h"

namespace tellurion::geo {

enum class MapScheme : std::uint8_t {
  geographic,    ///< 2 x 1 squares of 180 degrees at level 0, halved from level to level
  web_mercator,  ///< 1 square at level 0, up to kMercatorLimit north and south
};

inline constexpr int kMaxMapLevel = 30;
/// atan(sinh(pi)): where Web Mercator is cut off, so that the world is a square.
inline constexpr Radians kMercatorLimit{1.4844222297453324};

/// One tile of a map scheme, as in `z/x/y`.
struct MapKey {
  std::uint8_t level = 0;
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  friend constexpr auto operator<=>(const MapKey&, const MapKey&) = default;
};

constexpr std::uint32_t columns_of(MapScheme scheme, int level) {
  return std::uint32_t{scheme == MapScheme::geographic ? 2u : 1u} << level;
}
constexpr std::uint32_t rows_of(MapScheme, int level) { return 1u << level; }

constexpr bool is_valid(MapScheme scheme, const MapKey& key) {
  return key.level <= kMaxMapLevel && key.x < columns_of(scheme, key.level) && key.y < rows_of(scheme, key.level);
}

/// Requires level > 0.
constexpr MapKey parent(const MapKey& key) { return {static_cast<std::uint8_t>(key.level - 1), key.x / 2, key.y / 2}; }
/// Child `index` in 0..3: bit 0 is the column, bit 1 the row. Requires level < kMaxMapLevel.
constexpr MapKey child(const MapKey& key, int index) {
  return {static_cast<std::uint8_t>(key.level + 1), key.x * 2 + static_cast<std::uint32_t>(index & 1),
          key.y * 2 + static_cast<std::uint32_t>(index >> 1)};
}

/// The row as TMS counts it, from the south. Its own reverse.
constexpr std::uint32_t tms_row(const MapKey& key) { return (1u << key.level) - 1 - key.y; }

/// The rectangle of longitudes and latitudes that the tile covers.
GeodeticBounds bounds_of(MapScheme scheme, const MapKey& key);

/// The tile of `level` that holds `place`; nothing beyond the scheme's cut-off. A place on a border belongs to the tile
/// east or south of it, at the southern end to the last row.
std::optional<MapKey> map_key_at(MapScheme scheme, const LatLon& place, int level);

/// Position on the scheme's map: (0, 0) its north-west corner, (1, 1) the south-eastern one. Longitude is wrapped into
/// [0, 1); a latitude beyond Web Mercator's cut-off gives y outside of [0, 1] (infinite at the poles).
glm::dvec2 to_map(MapScheme scheme, const LatLon& place);
/// The reverse of to_map, for any x (not wrapped) and y.
LatLon from_map(MapScheme scheme, glm::dvec2 position);

/// The tile's quadkey: one digit 0..3 a level; empty at level 0.
std::string quadkey(const MapKey& key);
/// Errors: invalid_argument, naming the text.
Result<MapKey> parse_quadkey(std::string_view text);

}  // namespace tellurion::geo
