#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "source/proj/crs_axes.h"
#include "source/proj/projection.h"
#include "source/tiles/crs_name.h"
#include "source/tiles/service_grids.h"
#include "source/tiles/service_source.h"
#include "source/tiles/service_tiles.h"
#include "source/tiles/service_url.h"
#include "source/tiles/wmts_capabilities.h"

namespace tellurion::source {
namespace {

constexpr std::size_t kMostTried = 200;  ///< matrix sets

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

Error invalid(std::string what) { return {ErrorCode::invalid_argument, std::move(what)}; }

template <class List, class Name>
std::vector<std::string> names_of(const List& list, Name name) {
  std::vector<std::string> names;
  for (const auto& entry : list) names.push_back(name(entry));
  return names;
}

/// What is asked for, of all that the service has.
struct Choice {
  const WmtsLayer* layer = nullptr;
  const TileMatrixSet* set = nullptr;
  const WmtsLayer::MatrixSetLink* link = nullptr;
  CrsAxes axes;
  std::string style;
  std::string format;
  Parameters dimensions;
};

Result<const WmtsLayer*> choose_layer(const WmtsCapabilities& service, const ServiceOptions& options) {
  if (options.layer.empty() && service.layers.size() == 1) return &service.layers.front();
  if (const WmtsLayer* found = service.find_layer(options.layer)) return found;
  const std::string there = listed(names_of(service.layers, [](const auto& l) { return l.identifier; }));
  if (options.layer.empty()) return invalid(fmt::format("say which `layer`; it has {}", there));
  return invalid(fmt::format("has no layer \"{}\"; it has {}", options.layer, there));
}

Result<std::string> choose_style(const WmtsLayer& layer, const ServiceOptions& options) {
  const auto fits = [&](const WmtsLayer::Style& style) { return options.style.empty() ? style.is_default : style.identifier == options.style; };
  const auto found = std::find_if(layer.styles.begin(), layer.styles.end(), fits);
  if (found != layer.styles.end()) return found->identifier;
  if (options.style.empty()) return layer.styles.empty() ? std::string("default") : layer.styles.front().identifier;
  return invalid(fmt::format("its layer {} has no style \"{}\"; it has {}", layer.identifier, options.style, listed(names_of(layer.styles, [](const auto& s) { return s.identifier; }))));
}

/// Web Mercator before longitude and latitude before others; the set with more levels first.
int rank_of(const TileMatrixSet& set) {
  const std::string crs = crs_name(set.crs);
  const int kind = crs == "EPSG:3857" ? 0 : crs == "OGC:CRS84" || crs == "EPSG:4326" ? 1 : 2;
  return kind * 1000 - static_cast<int>(std::min<std::size_t>(set.matrices.size(), 999));
}

/// Fills in set, link and axes: the set that is wanted, or the best whose CRS can be used.
Result<void> choose_matrix_set(const WmtsCapabilities& service, const ServiceOptions& options, const geo::Ellipsoid& world, Choice& choice) {
  struct Candidate {
    int rank;
    const TileMatrixSet* set;
    const WmtsLayer::MatrixSetLink* link;
  };
  std::unordered_map<std::string_view, const TileMatrixSet*> by_name;
  for (const TileMatrixSet& set : service.matrix_sets) by_name.emplace(set.identifier, &set);
  std::vector<Candidate> sets;
  std::vector<std::string> names;
  for (const auto& link : choice.layer->links) {
    const auto found = by_name.find(link.set);
    if (found == by_name.end()) continue;
    const TileMatrixSet& set = *found->second;
    names.push_back(fmt::format("{} ({})", set.identifier, crs_name(set.crs)));
    if (options.matrix_set.empty() || options.matrix_set == set.identifier) sets.push_back({rank_of(set), &set, &link});
  }
  if (sets.empty() && !options.matrix_set.empty())
    return invalid(fmt::format("its layer {} has no tile matrix set \"{}\"; it has {}", choice.layer->identifier, options.matrix_set, listed(names)));
  std::stable_sort(sets.begin(), sets.end(), [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; });
  sets.erase(sets.begin() + static_cast<std::ptrdiff_t>(std::min(sets.size(), kMostTried)), sets.end());
  std::string why = "none";
  for (const auto& [rank, set, link] : sets) {
    const std::string crs = crs_name(set->crs);
    if (crs == "EPSG:3857" && !is_earth(world)) continue;
    const Result<CrsAxes> axes = axes_of(crs);
    if (axes) {
      choice.set = set;
      choice.link = link;
      choice.axes = *axes;
      return {};
    }
    why = axes.error().message;
  }
  return Error{ErrorCode::unsupported, fmt::format("its layer {} has no tile matrix set that can be shown ({}); it has {}", choice.layer->identifier, why, listed(names))};
}

Result<Parameters> choose_dimensions(const WmtsLayer& layer, const ServiceOptions& options) {
  Parameters chosen;
  for (const auto& [name, value] : options.dimensions) {
    const bool known = std::any_of(layer.dimensions.begin(), layer.dimensions.end(), [&](const auto& d) { return lower(d.identifier) == lower(name); });
    if (!known) return invalid(fmt::format("its layer {} has no dimension \"{}\"; it has {}", layer.identifier, name, listed(names_of(layer.dimensions, [](const auto& d) { return d.identifier; }))));
  }
  for (const WmtsLayer::Dimension& dimension : layer.dimensions) {
    std::string value = dimension.standard;
    for (const auto& [name, wanted] : options.dimensions) {
      if (lower(name) == lower(dimension.identifier)) value = wanted;
    }
    if (value.empty()) return invalid(fmt::format("its layer {} needs dimensions = {{ {} = \"...\" }}", layer.identifier, dimension.identifier));
    chosen.emplace_back(dimension.identifier, value);
  }
  return chosen;
}

/// A RESTful template's URL. Errors: unsupported, naming the field that nothing is known for.
Result<std::string> filled(const std::string& pattern, const Parameters& fields) {
  std::string url;
  std::size_t at = 0;
  for (std::size_t open = pattern.find('{'); open != std::string::npos; open = pattern.find('{', at)) {
    const std::size_t close = pattern.find('}', open);
    const std::string name = pattern.substr(open + 1, close == std::string::npos ? close : close - open - 1);
    const auto field = std::find_if(fields.begin(), fields.end(), [&](const auto& f) { return lower(f.first) == lower(name); });
    if (close == std::string::npos || field == fields.end())
      return Error{ErrorCode::unsupported, fmt::format("its template {} has a field {{{}}} that nothing is known for", fetch::public_part(pattern), name.substr(0, std::min<std::size_t>(name.find_first_of("?&/{"), 60)))};
    url += pattern.substr(at, open - at) + escaped(field->second, true);
    at = close + 1;
  }
  return url + pattern.substr(at);
}

using MakeUrl = std::function<Result<std::string>(const std::string& matrix, std::int64_t column, std::int64_t row)>;

/// By the layer's template for the format, or by parameters if it has none.
Result<MakeUrl> make_url(const WmtsCapabilities& service, const Choice& choice, const std::string& given) {
  const auto resource = std::find_if(choice.layer->resources.begin(), choice.layer->resources.end(), [&](const auto& r) { return r.format == choice.format; });
  const bool by_template = resource != choice.layer->resources.end();
  if (!by_template && service.get_tile.empty()) return Error{ErrorCode::unsupported, "names no address to get tiles from, neither a template nor one that takes parameters"};
  const std::string address = by_template ? resource->pattern : resolved_url(given, service.get_tile);
  return MakeUrl([by_template, address, given, set = choice.set->identifier, style = choice.style, format = choice.format, layer = choice.layer->identifier,
                  dimensions = choice.dimensions](const std::string& matrix, std::int64_t column, std::int64_t row) -> Result<std::string> {
    const std::string x = std::to_string(column), y = std::to_string(row);
    if (by_template) {
      Parameters fields{{"Style", style}, {"TileMatrixSet", set}, {"TileMatrix", matrix}, {"TileRow", y}, {"TileCol", x}, {"Layer", layer}};
      fields.insert(fields.end(), dimensions.begin(), dimensions.end());
      Result<std::string> url = filled(address, fields);
      return url ? Result<std::string>(with_given_parameters(resolved_url(given, *url), given)) : url;
    }
    Parameters fields{{"SERVICE", "WMTS"}, {"REQUEST", "GetTile"}, {"VERSION", "1.0.0"}, {"LAYER", layer}, {"STYLE", style}, {"FORMAT", format},
                      {"TILEMATRIXSET", set}, {"TILEMATRIX", matrix}, {"TILEROW", y}, {"TILECOL", x}};
    fields.insert(fields.end(), dimensions.begin(), dimensions.end());
    return with_parameters(with_given_parameters(address, given), fields);
  });
}

Result<Choice> choose(const WmtsCapabilities& service, const ServiceOptions& options, const geo::Ellipsoid& world) {
  Choice choice;
  const Result<const WmtsLayer*> layer = choose_layer(service, options);
  if (!layer) return layer.error();
  choice.layer = *layer;
  if (const Result<void> set = choose_matrix_set(service, options, world, choice); !set) return set.error();
  Result<std::string> style = choose_style(*choice.layer, options);
  if (!style) return style.error();
  std::vector<std::string> formats = choice.layer->formats;
  for (const auto& resource : choice.layer->resources) {
    if (std::find(formats.begin(), formats.end(), resource.format) == formats.end()) formats.push_back(resource.format);
  }
  Result<std::string> format = choose_format(options, formats, false);
  if (!format) return naming("its layer " + choice.layer->identifier, format.error());
  Result<Parameters> dimensions = choose_dimensions(*choice.layer, options);
  if (!dimensions) return dimensions.error();
  choice.style = std::move(*style);
  choice.format = std::move(*format);
  choice.dimensions = std::move(*dimensions);
  return choice;
}

/// The middle of the layer's bounds in the CRS; nothing if it is not known.
std::optional<glm::dvec2> middle_of(const WmtsLayer& layer, const std::string& crs, const geo::Ellipsoid& world) {
  if (!layer.bounds) return std::nullopt;
  Result<Projection> projection = Projection::create(crs, world, glm::dvec2(0.0));
  if (!projection) return std::nullopt;
  const auto& [west, south, east, north] = *layer.bounds;
  const geo::LatLon place{to_radians(Degrees(0.5 * (south + north))), to_radians(Degrees(0.5 * (west + east)))};
  glm::dvec2 at;
  projection->to_coordinates({&place, 1}, {&at, 1});
  return std::isfinite(at.x) && std::isfinite(at.y) ? std::optional(at) : std::nullopt;
}

std::string capabilities_url(const std::string& url) {
  const std::string path = url.substr(0, url.find_first_of("?#"));
  if (has_parameter(url, "request") || lower(path).ends_with(".xml")) return url;
  return with_parameters(url, {{"SERVICE", "WMTS"}, {"REQUEST", "GetCapabilities"}, {"VERSION", "1.0.0"}});
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_wmts(const ServiceOptions& options, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store) {
  const std::string url = capabilities_url(options.url), shown = fetch::without_credentials(url);
  const Result<WmtsCapabilities> service = fetch_document(url, options.headers, *store, &parse_wmts_capabilities);
  if (!service) return service.error();
  const Result<Choice> choice = choose(*service, options, world);
  if (!choice) return naming(shown, choice.error());
  const std::string crs = grid_crs(crs_name(choice->set->crs), choice->axes, world);
  Result<MatrixGrid> grid = matrix_grid(*choice->set, choice->link->limits, choice->axes, crs, middle_of(*choice->layer, crs, world));
  if (!grid) return naming(shown, grid.error());
  const Result<MakeUrl> made = make_url(*service, *choice, url);
  if (!made) return naming(shown, made.error());
  if (const Result<std::string> first = (*made)(grid->matrices.front(), 0, 0); !first) return naming(shown, first.error());

  TilePyramid pyramid;
  pyramid.name = fmt::format("{}#{},{},{},{}", shown, choice->layer->identifier, choice->style, choice->set->identifier, choice->format);
  for (const auto& [name, value] : choice->dimensions) pyramid.name += fmt::format(",{}={}", name, value);
  pyramid.grid = grid->grid;
  pyramid.attribution = service->provider.empty() ? service->title : service->provider;
  const UrlOfTile url_of = [make = *made, matrices = grid->matrices, ranges = grid->ranges](const TileAddress& tile) {
    const auto level = static_cast<std::size_t>(tile.zoom);
    if (!ranges[level].contains(tile)) return std::string();
    return make(matrices[level], tile.column, tile.row).value_or("");
  };
  pyramid.supply = service_tiles(url_of, options, choice->dimensions, std::move(store));
  return open_service(std::move(pyramid), options, choice->layer->bounds, world);
}

}  // namespace tellurion::source
