#include "source/tiles/cesium_layer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "fetch/transfer.h"
#include "source/tiles/service_url.h"

namespace tellurion::source {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostBytes = std::size_t{16} << 20;
constexpr std::size_t kMostLevels = 31;
constexpr std::size_t kMostRanges = 200'000;  ///< in all; asking for a tile looks through those of its level

Error corrupt(std::string what) { return {ErrorCode::corrupt, std::move(what)}; }

std::string text_of(const Json& table, const char* key, const std::string& otherwise) {
  const auto found = table.find(key);
  return found != table.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

std::optional<std::int64_t> integer_of(const Json& table, const char* key) {
  const auto found = table.find(key);
  if (found == table.end() || !found->is_number_integer()) return std::nullopt;
  const auto number = found->get<std::int64_t>();
  constexpr std::int64_t kMost = std::int64_t{1} << 31;
  return number >= 0 && number < kMost ? std::optional(number) : std::nullopt;
}

Result<void> read_format(const Json& layer, CesiumLayer& made) {
  const std::string format = text_of(layer, "format", "");
  if (format.starts_with("quantized-mesh-1.")) made.format = TerrainFormat::quantized_mesh;
  else if (format == "heightmap-1.0") made.format = TerrainFormat::heightmap;
  else return Error{ErrorCode::unsupported, fmt::format("has tiles of format \"{}\"; read are quantized-mesh-1.0 and heightmap-1.0", format)};
  const std::string projection = text_of(layer, "projection", "EPSG:4326");
  if (projection != "EPSG:4326" && projection != "EPSG:3857")
    return Error{ErrorCode::unsupported, fmt::format("has tiles in \"{}\"; read are EPSG:4326 and EPSG:3857", projection)};
  made.mercator = projection == "EPSG:3857";
  const std::string scheme = text_of(layer, "scheme", "tms");
  if (scheme != "tms" && scheme != "slippyMap") return Error{ErrorCode::unsupported, fmt::format("has tiles of the scheme \"{}\"; read are tms and slippyMap", scheme)};
  made.rows_from_south = scheme == "tms";
  return {};
}

Result<void> read_available(const Json& layer, CesiumLayer& made) {
  const auto levels = layer.find("available");
  if (levels == layer.end() || levels->is_null()) return {};
  const auto wrong = [] { return corrupt("has an `available` that is no list of levels with ranges startX, startY, endX, endY"); };
  if (!levels->is_array()) return wrong();
  if (levels->size() > kMostLevels) return Error{ErrorCode::exhausted, fmt::format("lists {} levels", levels->size())};
  std::size_t count = 0;
  for (const Json& level : *levels) {
    if (!level.is_array()) return wrong();
    count += level.size();
    if (count > kMostRanges) return Error{ErrorCode::exhausted, fmt::format("lists more than {} ranges of tiles", kMostRanges)};
    std::vector<CesiumLayer::Listed>& ranges = made.available.emplace_back();
    for (const Json& range : level) {
      if (!range.is_object()) return wrong();
      const auto x0 = integer_of(range, "startX"), y0 = integer_of(range, "startY"), x1 = integer_of(range, "endX"), y1 = integer_of(range, "endY");
      if (!x0 || !y0 || !x1 || !y1) return wrong();
      ranges.push_back({*x0, *y0, *x1, *y1});
    }
  }
  made.lists_more = layer.contains("metadataAvailability");
  return {};
}

/// The first level listed, else what the server says.
int coarsest_level(const Json& layer, const CesiumLayer& made) {
  const auto first = std::find_if(made.available.begin(), made.available.end(), [](const auto& ranges) { return !ranges.empty(); });
  if (first != made.available.end()) return static_cast<int>(first - made.available.begin());
  return static_cast<int>(std::min<std::int64_t>(integer_of(layer, "minzoom").value_or(0), kMostLevels - 1));
}

/// The finest level: what the server says, else the last one listed.
std::optional<int> finest_level(const Json& layer, const CesiumLayer& made) {
  std::optional<int> finest;
  if (const auto stated = integer_of(layer, "maxzoom")) finest = static_cast<int>(std::min<std::int64_t>(*stated, kMostLevels - 1));
  if (!made.available.empty() && !made.lists_more) {
    const auto last = std::find_if(made.available.rbegin(), made.available.rend(), [](const auto& ranges) { return !ranges.empty(); });
    const int listed = std::max(static_cast<int>(made.available.rend() - last) - 1, 0);
    finest = std::min(finest.value_or(listed), listed);
  }
  return finest;
}

/// Nothing if they are not such as we can use (across the antimeridian, say).
std::optional<std::array<double, 4>> read_bounds(const Json& layer) {
  const auto list = layer.find("bounds");
  if (list == layer.end() || !list->is_array() || list->size() != 4) return std::nullopt;
  std::array<double, 4> bounds{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (!(*list)[i].is_number()) return std::nullopt;
    const double limit = i % 2 == 0 ? 180.0 : 90.0;
    bounds[i] = std::clamp((*list)[i].get<double>(), -limit, limit);
  }
  return bounds[0] < bounds[2] && bounds[1] < bounds[3] ? std::optional(bounds) : std::nullopt;
}

bool replace_all(std::string& text, std::string_view from, std::string_view to) {
  bool found = false;
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
    found = true;
  }
  return found;
}

Result<std::string> read_url(const Json& layer, const CesiumLayer& made, const std::string& url) {
  const auto tiles = layer.find("tiles");
  if (tiles == layer.end() || !tiles->is_array() || tiles->empty() || !tiles->front().is_string()) return corrupt("names no tiles");
  std::string address = tiles->front().get<std::string>();
  replace_all(address, "{version}", text_of(layer, "version", "1.0.0"));
  if (made.rows_from_south) replace_all(address, "{y}", "{-y}");
  if (std::any_of(address.begin(), address.end(), [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '\x7f'; }))
    return corrupt("names tiles by what is no URL");
  const std::string absolute = resolved_url(url, address);
  if (!absolute.starts_with("http://") && !absolute.starts_with("https://"))
    return Error{ErrorCode::unsupported, fmt::format("names tiles by \"{}\"; read are http: and https:", fetch::public_part(absolute))};
  return with_given_parameters(absolute, url);
}

}  // namespace

bool CesiumLayer::may_have(const TileAddress& tile, std::int64_t rows) const {
  if (available.empty()) return true;
  const auto level = static_cast<std::size_t>(tile.zoom);
  if (level >= available.size()) return lists_more;
  const std::int64_t row = rows_from_south ? rows - 1 - tile.row : tile.row;
  const auto& ranges = available[level];
  return std::any_of(ranges.begin(), ranges.end(), [&](const Listed& range) {
    return tile.column >= range.first_column && tile.column <= range.last_column && row >= range.first_row && row <= range.last_row;
  });
}

Result<CesiumLayer> parse_cesium_layer(std::string_view text, const std::string& url) {
  if (text.size() > kMostBytes) return Error{ErrorCode::exhausted, fmt::format("has more than {} bytes", kMostBytes)};
  const Json layer = Json::parse(text, nullptr, false);
  if (!layer.is_object()) return corrupt("is no layer.json");
  CesiumLayer made;
  if (const auto read = read_format(layer, made); !read) return read.error();
  if (const auto read = read_available(layer, made); !read) return read.error();
  Result<std::string> address = read_url(layer, made, url);
  if (!address) return address.error();
  made.url = std::move(*address);
  made.min_zoom = coarsest_level(layer, made);
  made.max_zoom = finest_level(layer, made);
  made.bounds = read_bounds(layer);
  made.attribution = text_of(layer, "attribution", "");
  if (const std::string parent = text_of(layer, "parentUrl", ""); !parent.empty()) made.parent_url = resolved_url(url, parent);
  return made;
}

}  // namespace tellurion::source
