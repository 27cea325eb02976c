#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "source/proj/crs_axes.h"
#include "source/proj/projection.h"
#include "source/tiles/crs_name.h"
#include "source/tiles/service_grids.h"
#include "source/tiles/service_source.h"
#include "source/tiles/service_tiles.h"
#include "source/tiles/service_url.h"
#include "source/tiles/wms_capabilities.h"

namespace tellurion::source {
namespace {

using Box = std::array<double, 4>;  ///< least x, least y, most x, most y

constexpr int kUsualLevels = 18;           ///< the finest of a map of the Earth: 0.6 m
constexpr double kUsualFinest = 0.5;       ///< metres a pixel, of a regional map that does not say it
constexpr std::size_t kMostTried = 200;    ///< CRSs
constexpr double kStandardPixel = 0.00028; ///< metres
constexpr double kMetresPerDegree = geo::kWgs84.a() * std::numbers::pi / 180.0;

Error invalid(std::string what) { return {ErrorCode::invalid_argument, std::move(what)}; }

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t end = std::min(list.find(',', at), list.size());
    parts.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

/// All that the chosen layers have in common.
struct Choice {
  std::vector<WmsLayer> layers;   ///< resolved
  std::string crs;                ///< as the service writes it
  CrsAxes axes;
  std::string format;
  bool transparent = true;
  bool version_1_3 = true;
};

Result<std::vector<WmsLayer>> choose_layers(const WmsCapabilities& service, const ServiceOptions& options) {
  std::vector<std::string> there;
  for (const WmsLayer& layer : service.layers) {
    if (!layer.name.empty()) there.push_back(layer.name);
  }
  if (options.layer.empty() && there.size() != 1) return invalid(fmt::format("say which `layers`; it has {}", listed(there)));
  std::vector<WmsLayer> chosen;
  for (const std::string& name : split(options.layer.empty() ? there.front() : options.layer)) {
    const WmsLayer* found = service.find_layer(name);
    if (!found) return invalid(fmt::format("has no layer \"{}\"; it has {}", name, listed(there)));
    chosen.push_back(service.resolved(*found));
  }
  return chosen;
}

Result<void> check_styles(const std::vector<WmsLayer>& layers, const ServiceOptions& options) {
  if (options.style.empty()) return {};
  const std::vector<std::string> styles = split(options.style);
  if (styles.size() != layers.size()) return invalid(fmt::format("has {} layers and {} styles: name as many, with commas between them; an empty one is the default", layers.size(), styles.size()));
  for (std::size_t i = 0; i < styles.size(); ++i) {
    const auto& there = layers[i].styles;
    if (!styles[i].empty() && std::find(there.begin(), there.end(), styles[i]) == there.end())
      return invalid(fmt::format("its layer {} has no style \"{}\"; it has {}", layers[i].name, styles[i], listed(there)));
  }
  return {};
}

/// CRSs that all the layers have, as the first one writes them.
std::vector<std::string> common_crs(const std::vector<WmsLayer>& layers) {
  std::vector<std::unordered_set<std::string>> others;
  for (auto layer = layers.begin() + 1; layer != layers.end(); ++layer) {
    auto& names = others.emplace_back();
    for (const std::string& written : layer->crs) names.insert(crs_name(written));
  }
  std::vector<std::string> common;
  for (const std::string& written : layers.front().crs) {
    const std::string name = crs_name(written);
    if (std::all_of(others.begin(), others.end(), [&](const auto& names) { return names.contains(name); })) common.push_back(written);
  }
  return common;
}

/// Whether a map in the CRS can be shown on the world; degrees of the Earth count as those of any body.
bool suits(const std::string& name, const CrsAxes& axes, const geo::Ellipsoid& world) {
  const bool same_body = std::abs(axes.radius / world.a() - 1.0) <= 0.01;
  return same_body || (axes.is_geographic && (name == "EPSG:4326" || name == "OGC:CRS84"));
}

/// Fills in crs and axes: the one that is wanted, else Web Mercator, longitude and latitude, or the first that PROJ knows.
Result<void> choose_crs(const ServiceOptions& options, const geo::Ellipsoid& world, Choice& choice) {
  const std::vector<std::string> there = common_crs(choice.layers);
  const auto try_one = [&](const std::string& written) -> Result<void> {
    const Result<CrsAxes> axes = axes_of(crs_name(written));
    if (!axes) return axes.error();
    if (!suits(crs_name(written), *axes, world)) return invalid(fmt::format("the CRS {} is of another body than the world", written));
    choice.crs = written;
    choice.axes = *axes;
    return {};
  };
  if (!options.crs.empty()) {
    const auto found = std::find_if(there.begin(), there.end(), [&](const std::string& written) { return crs_name(written) == crs_name(options.crs); });
    if (found == there.end()) return invalid(fmt::format("its layers are not to be had in the CRS \"{}\"; they are in {}", options.crs, listed(there)));
    const Result<void> tried = try_one(*found);
    return tried ? tried : Result<void>(invalid(fmt::format("{}; its layers are in {}", tried.error().message, listed(there))));
  }
  const bool on_earth = is_earth(world);
  const auto rank = [&](const std::string& written) {
    const std::string name = crs_name(written);
    if (on_earth) return name == "EPSG:3857" ? 0 : name == "OGC:CRS84" ? 1 : name == "EPSG:4326" ? 2 : 3;
    return name == "OGC:CRS84" || name == "EPSG:4326" ? 4 : 3;  // a body's own before the Earth's degrees
  };
  std::vector<std::pair<int, std::string>> ranked;
  for (const std::string& written : there) ranked.emplace_back(rank(written), written);
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < std::min(ranked.size(), kMostTried); ++i) {
    if (try_one(ranked[i].second)) return {};
  }
  return Error{ErrorCode::unsupported, fmt::format("its layers are in no CRS that PROJ knows on this body; they are in {}", listed(there))};
}

/// The least box round all of them; nothing if one has none.
template <class BoxOf>
std::optional<Box> union_of(const std::vector<WmsLayer>& layers, BoxOf box_of) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  Box all{kAll, kAll, -kAll, -kAll};
  for (const WmsLayer& layer : layers) {
    const std::optional<Box> box = box_of(layer);
    if (!box) return std::nullopt;
    all = {std::min(all[0], (*box)[0]), std::min(all[1], (*box)[1]), std::max(all[2], (*box)[2]), std::max(all[3], (*box)[3])};
  }
  return all;
}

/// A layer's extent in the CRS as the service declares it, x to the right.
std::optional<Box> declared_box(const WmsLayer& layer, const Choice& choice, bool written_1_3) {
  const auto found = std::find_if(layer.boxes.begin(), layer.boxes.end(), [&](const WmsLayer::Box& box) { return crs_name(box.crs) == crs_name(choice.crs); });
  if (found == layer.boxes.end()) return std::nullopt;
  const Box& b = found->edges;
  return written_1_3 && choice.axes.north_first ? Box{b[1], b[0], b[3], b[2]} : b;
}

/// What degrees come to in the CRS: round a net of places, since in most projections no two corners bound them.
Result<Box> projected_box(const Box& degrees, const std::string& crs, const geo::Ellipsoid& world) {
  Result<Projection> projection = Projection::create(crs, world, glm::dvec2(0.0));
  if (!projection) return projection.error();
  constexpr int kSteps = 64;
  std::vector<geo::LatLon> places;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
      places.push_back({to_radians(Degrees(degrees[1] + v * (degrees[3] - degrees[1]))), to_radians(Degrees(degrees[0] + u * (degrees[2] - degrees[0])))});
    }
  }
  std::vector<glm::dvec2> at(places.size());
  projection->to_coordinates(places, at);
  constexpr double kAll = std::numeric_limits<double>::infinity();
  Box box{kAll, kAll, -kAll, -kAll};
  for (const glm::dvec2& p : at) {
    if (std::isfinite(p.x) && std::isfinite(p.y)) box = {std::min(box[0], p.x), std::min(box[1], p.y), std::max(box[2], p.x), std::max(box[3], p.y)};
  }
  if (!(box[0] < box[2] && box[1] < box[3])) return invalid(fmt::format("its layers' bounds cannot be found in {}: say bounds = [west, south, east, north]", crs));
  return box;
}

/// The finest and the coarsest pixel at which all layers are drawn, in units of the CRS; 0 and infinity if nothing is said.
std::pair<double, double> pixel_limits(const Choice& choice) {
  std::pair<double, double> limits(0.0, std::numeric_limits<double>::infinity());
  const double unit = choice.axes.is_geographic ? kMetresPerDegree : choice.axes.metres_per_unit;
  for (const WmsLayer& layer : choice.layers) {
    if (layer.least_scale) limits.first = std::max(limits.first, *layer.least_scale * kStandardPixel / unit);
    if (layer.most_scale) limits.second = std::min(limits.second, *layer.most_scale * kStandardPixel / unit);
  }
  return limits;
}

/// A grid of our own: a WMS draws any box.
Result<TileGrid> virtual_grid(const WmsCapabilities& service, const ServiceOptions& options, const Choice& choice, int tile_size, const geo::Ellipsoid& world) {
  const std::string name = crs_name(choice.crs), crs = grid_crs(name, choice.axes, world);
  const auto [finest, coarsest] = pixel_limits(choice);
  Result<TileGrid> grid = Error{};
  if (name == "EPSG:3857" || choice.axes.is_geographic) {
    const int last = choice.axes.is_geographic ? kUsualLevels - 1 : kUsualLevels;
    const int most = std::max(options.most_level.value_or(last), 0);
    grid = choice.axes.is_geographic ? geographic_grid(tile_size, 0, most, world) : web_mercator_grid(tile_size, 0, most);
    if (grid) grid->crs = crs;
  } else {
    const std::optional<Box> bounds = options.bounds ? options.bounds : union_of(choice.layers, [](const WmsLayer& l) { return l.bounds; });
    std::optional<Box> box = options.bounds ? std::nullopt : union_of(choice.layers, [&](const WmsLayer& l) { return declared_box(l, choice, service.is_1_3); });
    if (!box) {
      if (!bounds) return invalid(fmt::format("does not say how far its layers reach: say bounds = [west, south, east, north]"));
      const Result<Box> projected = projected_box(*bounds, crs, world);
      if (!projected) return projected.error();
      box = *projected;
    }
    grid = box_grid(crs, *box, tile_size, options.most_level ? 0.0 : kUsualFinest / choice.axes.metres_per_unit);
  }
  if (!grid) return grid.error();
  // Not beyond the scales at which the layers are drawn, unless the user says so.
  auto& levels = grid->levels;
  while (!options.most_level && levels.size() > 1 && levels.back().pixel.x < finest * (1 - 1e-6)) levels.pop_back();
  while (!options.least_level && grid->min_zoom + 1 < static_cast<int>(levels.size()) && levels[static_cast<std::size_t>(grid->min_zoom)].pixel.x > coarsest) ++grid->min_zoom;
  return grid;
}

/// Few digits, no exponents: servers differ in what they read.
std::string decimal(double number) {
  std::string text = fmt::format("{:.10f}", number);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string box_text(const TileGrid& grid, const TileAddress& tile, bool north_first) {
  const TileLevel& level = grid.levels[static_cast<std::size_t>(tile.zoom)];
  const glm::dvec2 size = level.pixel * glm::dvec2(grid.tile_width, grid.tile_height);
  const double west = level.corner.x + static_cast<double>(tile.column) * size.x, north = level.corner.y - static_cast<double>(tile.row) * size.y;
  const std::string x0 = decimal(west), x1 = decimal(west + size.x), y0 = decimal(north - size.y), y1 = decimal(north);
  return north_first ? fmt::format("{},{},{},{}", y0, x0, y1, x1) : fmt::format("{},{},{},{}", x0, y0, x1, y1);
}

Result<Choice> choose(const WmsCapabilities& service, const ServiceOptions& options, const geo::Ellipsoid& world) {
  Choice choice;
  Result<std::vector<WmsLayer>> layers = choose_layers(service, options);
  if (!layers) return layers.error();
  choice.layers = std::move(*layers);
  if (const Result<void> styles = check_styles(choice.layers, options); !styles) return styles.error();
  if (const Result<void> crs = choose_crs(options, world, choice); !crs) return crs.error();
  const bool opaque = choice.layers.front().opaque.value_or(false);
  choice.transparent = options.transparent.value_or(!opaque);
  Result<std::string> format = choose_format(options, service.formats, !choice.transparent);
  if (!format) return format.error();
  choice.format = std::move(*format);
  choice.version_1_3 = options.version.empty() ? service.is_1_3 : options.version.starts_with("1.3");
  return choice;
}

std::string capabilities_url(const ServiceOptions& options) {
  std::string path = options.url.substr(0, options.url.find_first_of("?#"));
  if (has_parameter(options.url, "request") || path.ends_with(".xml")) return options.url;
  return with_parameters(options.url, {{"SERVICE", "WMS"}, {"REQUEST", "GetCapabilities"}, {"VERSION", options.version.empty() ? "1.3.0" : options.version}});
}

/// What does not change from tile to tile.
std::string get_map_url(const WmsCapabilities& service, const ServiceOptions& options, const Choice& choice, const std::string& given, int tile_size) {
  const std::string address = service.get_map.empty() ? options.url : resolved_url(given, service.get_map);
  std::string names;
  for (const WmsLayer& layer : choice.layers) names += (names.empty() ? "" : ",") + layer.name;
  const std::string styles = options.style.empty() ? std::string(choice.layers.size() - 1, ',') : options.style;
  Parameters fields{{"SERVICE", "WMS"}, {"REQUEST", "GetMap"}, {"VERSION", choice.version_1_3 ? "1.3.0" : "1.1.1"}, {"LAYERS", names}, {"STYLES", styles},
                    {choice.version_1_3 ? "CRS" : "SRS", choice.crs}, {"WIDTH", std::to_string(tile_size)}, {"HEIGHT", std::to_string(tile_size)},
                    {"FORMAT", choice.format}, {"TRANSPARENT", choice.transparent ? "TRUE" : "FALSE"}};
  for (const auto& [name, value] : options.dimensions) fields.emplace_back(name, value);
  return with_parameters(with_given_parameters(address, given), fields);
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_wms(const ServiceOptions& options, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store) {
  const std::string url = capabilities_url(options), shown = fetch::without_credentials(url);
  const Result<WmsCapabilities> service = fetch_document(url, options.headers, *store, &parse_wms_capabilities);
  if (!service) return service.error();
  const Result<Choice> choice = choose(*service, options, world);
  if (!choice) return naming(shown, choice.error());
  const int tile_size = std::min({options.tile_size, service->most_width.value_or(options.tile_size), service->most_height.value_or(options.tile_size)});
  if (tile_size < 16) return naming(shown, {ErrorCode::unsupported, fmt::format("draws pictures of at most {} pixels", tile_size)});
  Result<TileGrid> grid = virtual_grid(*service, options, *choice, tile_size, world);
  if (!grid) return naming(shown, grid.error());

  TilePyramid pyramid;
  pyramid.grid = std::move(*grid);
  const std::string request = get_map_url(*service, options, *choice, url, tile_size);
  const std::string extent = box_text(pyramid.grid, {0, 0, 0}, false);
  pyramid.name = fmt::format("{}#{}", fetch::without_credentials(request), extent);  // another extent cuts other tiles
  pyramid.attribution = choice->layers.front().attribution.empty() ? service->title : choice->layers.front().attribution;
  const bool north_first = choice->version_1_3 && choice->axes.north_first;
  const UrlOfTile url_of = [request, grid_of = pyramid.grid, north_first](const TileAddress& tile) { return request + "&BBOX=" + box_text(grid_of, tile, north_first); };
  const Parameters dimensions(options.dimensions.begin(), options.dimensions.end());
  pyramid.revision = pyramid.name + mark_of(dimensions);
  pyramid.supply = service_tiles(url_of, options, dimensions, std::move(store));
  const std::optional<Box> bounds = union_of(choice->layers, [](const WmsLayer& l) { return l.bounds; });
  return open_service(std::move(pyramid), options, bounds, world);
}

}  // namespace tellurion::source
