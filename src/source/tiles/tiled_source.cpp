#include "source/tiles/tiled_source.h"

#include <utility>

#include <fmt/format.h>

#include "raster/height_codes.h"
#include "source/tiles/height_decoders.h"
#include "source/tiles/url_tiles.h"

namespace tellurion::source {

Result<std::unique_ptr<RasterSource>> open_tiles(const TileService& service, const geo::Ellipsoid& world,
                                                 std::shared_ptr<fetch::ByteStore> store) {
  TilePyramid pyramid;
  pyramid.name = fetch::without_credentials(service.url);
  const auto naming = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", pyramid.name, error.message)}; };
  Result<TileGrid> grid = service.scheme == TileScheme::geographic ? geographic_grid(service.tile_size, service.min_zoom, service.max_zoom, world)
                                                                   : web_mercator_grid(service.tile_size, service.min_zoom, service.max_zoom);
  if (!grid) return naming(grid.error());
  Result<TileTemplate> address = TileTemplate::parse(service.url, service.subdomains);
  if (!address) return naming(address.error());
  pyramid.grid = std::move(*grid);
  pyramid.kind = service.kind;
  pyramid.decode_heights = height_decoder(service.encoding, pyramid.grid);
  pyramid.encoding = service.encoding;
  if (service.kind == SampleKind::height && !raster::height_code(service.encoding)) pyramid.sample_type = "Float32";
  pyramid.bounds = service.bounds;
  pyramid.vertical = service.vertical;
  pyramid.supply = url_tiles(std::move(*address), service.headers, pyramid.name, pyramid.grid, std::move(store));
  return open_pyramid(std::move(pyramid), world);
}

}  // namespace tellurion::source
