#include <fmt/format.h>

#include "source/proj/crs_axes.h"
#include "source/tiles/crs_name.h"
#include "source/tiles/service_grids.h"
#include "source/tiles/service_source.h"
#include "source/tiles/service_tiles.h"
#include "source/tiles/service_url.h"
#include "source/tiles/tms_resource.h"

namespace tellurion::source {
namespace {

/// The CRS that the document names, or the one that its profile means.
std::string crs_of(const TmsResource& map) {
  if (!map.crs.empty()) return crs_name(map.crs);
  if (map.profile.ends_with("mercator")) return "EPSG:3857";
  return map.profile.ends_with("geodetic") ? "EPSG:4326" : "";
}

/// A folder's document, with what else the URL says.
std::string document_url(const std::string& url) {
  const std::size_t end = std::min(url.find_first_of("?#"), url.size());
  if (end == 0 || url[end - 1] != '/') return url;
  return url.substr(0, end) + "tilemapresource.xml" + url.substr(end);
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_tms(const ServiceOptions& options, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store) {
  const std::string url = document_url(options.url), shown = fetch::without_credentials(url);
  const Result<TmsResource> map = fetch_document(url, options.headers, *store, &parse_tms_resource);
  if (!map) return map.error();
  const std::string crs = crs_of(*map);
  if (crs.empty()) return naming(shown, {ErrorCode::unsupported, "names no <SRS>: tiles of a plain picture lie nowhere on a planet"});
  const Result<CrsAxes> axes = axes_of(crs);
  if (!axes) return naming(shown, axes.error());
  Result<TmsGrid> grid = tms_grid(*map, *axes, crs);
  if (!grid) return naming(shown, grid.error());

  TilePyramid pyramid;
  pyramid.name = shown;
  pyramid.grid = grid->grid;
  pyramid.grid.crs = grid_crs(crs, *axes, world);
  pyramid.attribution = map->attribution.empty() ? map->title : map->attribution;
  std::vector<std::string> folders;
  for (const std::string& href : grid->hrefs) {
    folders.push_back(resolved_url(url, href));
    if (!folders.back().ends_with('/')) folders.back() += '/';
  }
  const UrlOfTile url_of = [url, folders, extension = map->extension, ranges = grid->ranges, south_rows = grid->south_rows](const TileAddress& tile) {
    const auto level = static_cast<std::size_t>(tile.zoom);
    if (!ranges[level].contains(tile)) return std::string();
    return with_given_parameters(fmt::format("{}{}/{}.{}", folders[level], tile.column, south_rows[level] - tile.row, extension), url);
  };
  pyramid.supply = service_tiles(url_of, options, {}, std::move(store));
  return open_service(std::move(pyramid), options, grid->bounds, world);
}

}  // namespace tellurion::source
