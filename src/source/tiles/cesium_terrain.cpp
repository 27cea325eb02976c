#include "source/tiles/cesium_terrain.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "fetch/fetch_now.h"
#include "source/proj/vertical_datum.h"
#include "source/tiles/archive_tile.h"
#include "source/tiles/cesium_layer.h"
#include "source/tiles/height_decoders.h"
#include "source/tiles/service_url.h"
#include "source/tiles/tile_pyramid.h"
#include "source/tiles/tile_template.h"
#include "source/tiles/url_tiles.h"

namespace tellurion::source {
namespace {

constexpr std::chrono::seconds kPatience{30};

/// The user's headers, for the server of the user's URL only, and what servers look at to send terrain, unless the user says otherwise.
std::vector<std::string> headers_for(const std::string& tiles, const CesiumTerrain& terrain) {
  std::vector<std::string> headers;
  if (same_server(tiles, terrain.url)) headers = terrain.headers;
  const auto is_accept = [](std::string header) {
    std::transform(header.begin(), header.end(), header.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return header.starts_with("accept:");
  };
  if (std::none_of(headers.begin(), headers.end(), is_accept)) headers.emplace_back("Accept: application/vnd.quantized-mesh,application/octet-stream;q=0.9");
  return headers;
}

Result<CesiumLayer> fetch_layer(const CesiumTerrain& terrain, fetch::ByteStore& store) {
  const std::string name = fetch::without_credentials(terrain.url);
  const Result<std::string> text = fetch::fetch_now(store, {terrain.url, terrain.headers, name, {}}, kPatience);
  if (!text) return text.error();
  Result<CesiumLayer> layer = parse_cesium_layer(*text, terrain.url);
  if (layer) return layer;
  const std::string why = fmt::format("{}: {}", fetch::public_part(terrain.url), without_secrets(layer.error().message, terrain.url, name));
  store.reject(name, why);
  return Error{layer.error().code, why};
}

/// Finer levels of tiles of that size cannot be numbered: twice 2^level of them lie side by side, in 2^30 pixels at most.
int deepest_level(int tile_size) { return 29 - std::bit_width(static_cast<unsigned>(tile_size - 1)); }

Result<TileGrid> grid_of(const CesiumLayer& layer, const CesiumTerrain& terrain, const geo::Ellipsoid& world) {
  if (!layer.max_zoom && !terrain.max_zoom) return Error{ErrorCode::invalid_argument, "does not say how fine its tiles are: say max_level in the world file"};
  const int deepest = deepest_level(terrain.tile_size);
  const int finest = std::min({layer.max_zoom.value_or(deepest), terrain.max_zoom.value_or(deepest), deepest});
  const int coarsest = std::min(layer.min_zoom, finest);
  return layer.mercator ? web_mercator_grid(terrain.tile_size, coarsest, finest) : geographic_grid(terrain.tile_size, coarsest, finest, world);
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_cesium_terrain(const CesiumTerrain& terrain, const geo::Ellipsoid& world,
                                                          std::shared_ptr<fetch::ByteStore> store) {
  const auto naming = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", fetch::public_part(terrain.url), error.message)}; };
  Result<CesiumLayer> layer = fetch_layer(terrain, *store);
  if (!layer) return layer.error();
  Result<TileGrid> grid = grid_of(*layer, terrain, world);
  if (!grid) return naming(grid.error());
  Result<TileTemplate> address = TileTemplate::parse(layer->url, {});
  if (!address) return naming(address.error());

  TilePyramid pyramid;
  const std::string tiles = layer->url;
  pyramid.name = fetch::without_credentials(tiles);  // with the version of the tiles, so that caches tell them apart
  pyramid.grid = std::move(*grid);
  pyramid.kind = SampleKind::height;
  pyramid.decode_heights = height_decoder(layer->format == TerrainFormat::heightmap ? kHeightmap : kQuantizedMesh, pyramid.grid);
  pyramid.sample_type = layer->format == TerrainFormat::heightmap ? "UInt16" : "Float32";
  pyramid.bounds = layer->bounds;
  pyramid.vertical = terrain.vertical.value_or(kEllipsoidDatum);
  pyramid.attribution = layer->attribution;
  if (!layer->parent_url.empty())
    pyramid.hints.push_back(fmt::format("{} lacks tiles that another service has ({}): make that one a layer of its own, before this one.",
                                        fetch::public_part(terrain.url), plain_text(fetch::public_part(layer->parent_url))));
  std::vector<std::int64_t> rows;
  for (const TileLevel& level : pyramid.grid.levels) rows.push_back(level.rows);
  const auto may_have = [layer = std::move(*layer), rows = std::move(rows)](const TileAddress& tile) {
    return layer.may_have(tile, rows[static_cast<std::size_t>(tile.zoom)]);
  };
  pyramid.supply = url_tiles(std::move(*address), headers_for(tiles, terrain), pyramid.name, pyramid.grid, std::move(store), may_have);
  return open_pyramid(std::move(pyramid), world);
}

}  // namespace tellurion::source
