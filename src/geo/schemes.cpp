#include "geo/schemes.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tellurion::geo {

using std::numbers::pi;

GeodeticBounds bounds_of(MapScheme scheme, const MapKey& key) {
  assert(is_valid(scheme, key));
  const glm::dvec2 size(1.0 / columns_of(scheme, key.level), 1.0 / rows_of(scheme, key.level));
  const glm::dvec2 corner(key.x, key.y);
  const LatLon north_west = from_map(scheme, corner * size);
  const LatLon south_east = from_map(scheme, (corner + 1.0) * size);
  return {south_east.latitude, north_west.latitude, north_west.longitude, south_east.longitude};
}

std::optional<MapKey> map_key_at(MapScheme scheme, const LatLon& place, int level) {
  assert(level >= 0 && level <= kMaxMapLevel);
  if (scheme == MapScheme::web_mercator && std::abs(place.latitude.value) > kMercatorLimit.value) return std::nullopt;
  const glm::dvec2 position = to_map(scheme, place);
  const auto cell = [](double fraction, std::uint32_t count) {
    return static_cast<std::uint32_t>(std::clamp(fraction * count, 0.0, count - 1.0));
  };
  return MapKey{static_cast<std::uint8_t>(level), cell(position.x, columns_of(scheme, level)),
                cell(position.y, rows_of(scheme, level))};
}

glm::dvec2 to_map(MapScheme scheme, const LatLon& place) {
  const double turns = place.longitude.value / (2.0 * pi) + 0.5;
  double x = turns - std::floor(turns);
  if (x == 1.0) x = 0.0;  // a tiny negative number of turns, rounded
  const double latitude = place.latitude.value;
  if (scheme == MapScheme::geographic) return {x, 0.5 - latitude / pi};
  return {x, 0.5 - std::asinh(std::tan(latitude)) / (2.0 * pi)};
}

LatLon from_map(MapScheme scheme, glm::dvec2 position) {
  const Radians longitude((2.0 * position.x - 1.0) * pi);
  if (scheme == MapScheme::geographic) return {Radians((0.5 - position.y) * pi), longitude};
  return {Radians(std::atan(std::sinh((1.0 - 2.0 * position.y) * pi))), longitude};
}

std::string quadkey(const MapKey& key) {
  assert(is_valid(MapScheme::web_mercator, key));
  std::string digits;
  for (int bit = key.level - 1; bit >= 0; --bit) {
    digits += static_cast<char>('0' + ((key.x >> bit) & 1u) + 2 * ((key.y >> bit) & 1u));
  }
  return digits;
}

Result<MapKey> parse_quadkey(std::string_view text) {
  MapKey key;
  if (text.size() <= kMaxMapLevel) {
    for (const char digit : text) {
      if (digit < '0' || digit > '3') break;
      key = child(key, digit - '0');
    }
  }
  if (key.level != text.size()) {
    return Error{ErrorCode::invalid_argument,
                 "no quadkey: '" + std::string(text.substr(0, 80)) + "' (wanted: at most 30 digits of 0 to 3)"};
  }
  return key;
}

}  // namespace tellurion::geo
