#include "source/tiles/wms_capabilities.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_set>

#include <fmt/format.h>

#include "source/tiles/bounded_xml.h"

namespace tellurion::source {
namespace {

constexpr int kDeepest = 64;  ///< layers within layers

std::optional<std::array<double, 4>> edges_of(const pugi::xml_node& box) {
  const auto west = attribute_number(box, "minx"), south = attribute_number(box, "miny");
  const auto east = attribute_number(box, "maxx"), north = attribute_number(box, "maxy");
  if (!west || !south || !east || !north || !(*west < *east && *south < *north)) return std::nullopt;
  return std::array{*west, *south, *east, *north};
}

std::optional<std::array<double, 4>> geographic_bounds(const pugi::xml_node& layer) {
  if (const pugi::xml_node box = child(layer, "LatLonBoundingBox")) return edges_of(box);
  const pugi::xml_node box = child(layer, "EX_GeographicBoundingBox");
  const auto west = child_number(box, "westBoundLongitude"), south = child_number(box, "southBoundLatitude");
  const auto east = child_number(box, "eastBoundLongitude"), north = child_number(box, "northBoundLatitude");
  if (!west || !south || !east || !north || !(*south < *north)) return std::nullopt;
  if (*west >= *east) return std::array{-180.0, *south, 180.0, *north};  // across the antimeridian
  return std::array{*west, *south, *east, *north};
}

/// 1.1's ScaleHint is a pixel's diagonal in metres.
std::optional<double> scale_of_hint(const pugi::xml_node& hint, const char* which) {
  const auto diagonal = attribute_number(hint, which);
  if (!diagonal || !(*diagonal > 0)) return std::nullopt;
  return *diagonal / std::numbers::sqrt2 / 0.00028;
}

void read_scales(const pugi::xml_node& node, WmsLayer& layer) {
  layer.least_scale = child_number(node, "MinScaleDenominator");
  layer.most_scale = child_number(node, "MaxScaleDenominator");
  const pugi::xml_node hint = child(node, "ScaleHint");
  if (!layer.least_scale) layer.least_scale = scale_of_hint(hint, "min");
  if (!layer.most_scale) layer.most_scale = scale_of_hint(hint, "max");
  if (layer.least_scale && !(*layer.least_scale > 0)) layer.least_scale.reset();
  if (layer.most_scale && !(*layer.most_scale > 0)) layer.most_scale.reset();
}

WmsLayer read_layer(const pugi::xml_node& node, int parent) {
  WmsLayer layer;
  layer.parent = parent;
  layer.name = child_text(node, "Name");
  layer.attribution = child_text(child(node, "Attribution"), "Title");
  for (const char* name : {"CRS", "SRS"}) {
    for (const pugi::xml_node& crs : children(node, name)) {
      const std::string all = text_of(crs);  // in 1.1.0 several, with blanks between them
      for (std::size_t at = 0; at < all.size();) {
        const std::size_t end = std::min(all.find_first_of(" \t\r\n", at), all.size());
        if (end > at) layer.crs.push_back(all.substr(at, end - at));
        at = end + 1;
      }
    }
  }
  layer.bounds = geographic_bounds(node);
  for (const pugi::xml_node& box : children(node, "BoundingBox")) {
    std::string crs = attribute(box, "CRS");
    if (crs.empty()) crs = attribute(box, "SRS");
    if (const auto edges = edges_of(box)) layer.boxes.push_back({std::move(crs), *edges});
  }
  for (const pugi::xml_node& style : children(node, "Style")) layer.styles.push_back(child_text(style, "Name"));
  read_scales(node, layer);
  if (const std::string opaque = attribute(node, "opaque"); !opaque.empty()) layer.opaque = opaque == "1" || opaque == "true";
  return layer;
}

bool read_layers(const pugi::xml_node& node, int parent, int depth, std::vector<WmsLayer>& layers) {
  if (depth > kDeepest) return false;
  for (const pugi::xml_node& found : children(node, "Layer")) {
    layers.push_back(read_layer(found, parent));
    if (!read_layers(found, static_cast<int>(layers.size()) - 1, depth + 1, layers)) return false;
  }
  return true;
}

std::optional<int> pixels(const pugi::xml_node& service, const char* name) {
  const auto count = child_count(service, name);
  if (!count || *count < 1) return std::nullopt;
  return static_cast<int>(std::min<std::int64_t>(*count, 1 << 20));
}

}  // namespace

const WmsLayer* WmsCapabilities::find_layer(std::string_view name) const {
  if (name.empty()) return nullptr;
  const auto found = std::find_if(layers.begin(), layers.end(), [&](const WmsLayer& l) { return l.name == name; });
  return found == layers.end() ? nullptr : &*found;
}

WmsLayer WmsCapabilities::resolved(const WmsLayer& layer) const {
  WmsLayer all = layer;
  std::unordered_set<std::string> known(layer.crs.begin(), layer.crs.end());
  for (int at = layer.parent; at >= 0; at = layers[static_cast<std::size_t>(at)].parent) {
    const WmsLayer& above = layers[static_cast<std::size_t>(at)];
    for (const std::string& crs : above.crs) {
      if (known.insert(crs).second) all.crs.push_back(crs);
    }
    all.styles.insert(all.styles.end(), above.styles.begin(), above.styles.end());
    all.boxes.insert(all.boxes.end(), above.boxes.begin(), above.boxes.end());  // the nearest of a CRS comes first
    if (!all.bounds) all.bounds = above.bounds;
    if (all.attribution.empty()) all.attribution = above.attribution;
    if (!all.least_scale) all.least_scale = above.least_scale;
    if (!all.most_scale) all.most_scale = above.most_scale;
    if (!all.opaque) all.opaque = above.opaque;
  }
  return all;
}

Result<WmsCapabilities> parse_wms_capabilities(std::string_view bytes) {
  const Result<XmlDocument> document = read_xml(bytes);
  if (!document) return document.error();
  if (const auto exception = exception_text(**document)) return Error{ErrorCode::unsupported, "the service says: " + *exception};
  const pugi::xml_node root = (*document)->document_element();
  const std::string_view name = local_name(root);
  const std::string version = attribute(root, "version");
  if (name == "Capabilities" && child(root, "Contents")) return Error{ErrorCode::unsupported, "is a WMTS, not a WMS: its type is \"wmts\""};
  if (name != "WMS_Capabilities" && name != "WMT_MS_Capabilities")
    return Error{ErrorCode::corrupt, fmt::format("is no capabilities document of a WMS: its root is <{}>", name.substr(0, 60))};
  if (!version.starts_with("1.1.") && !version.starts_with("1.3."))
    return Error{ErrorCode::unsupported, fmt::format("is a WMS of version \"{}\"; 1.1.1 and 1.3.0 are read", version.substr(0, 20))};

  WmsCapabilities service;
  service.is_1_3 = version.starts_with("1.3.");
  const pugi::xml_node about = child(root, "Service"), capability = child(root, "Capability");
  const pugi::xml_node get_map = child(child(capability, "Request"), "GetMap");
  service.title = child_text(about, "Title");
  service.most_width = pixels(about, "MaxWidth");
  service.most_height = pixels(about, "MaxHeight");
  for (const pugi::xml_node& format : children(get_map, "Format")) service.formats.push_back(text_of(format));
  service.get_map = attribute(child(child(child(child(get_map, "DCPType"), "HTTP"), "Get"), "OnlineResource"), "href");
  if (!read_layers(capability, -1, 0, service.layers)) return Error{ErrorCode::exhausted, fmt::format("its layers are nested more than {} deep", kDeepest)};
  const bool any = std::any_of(service.layers.begin(), service.layers.end(), [](const WmsLayer& l) { return !l.name.empty(); });
  if (!any) return Error{ErrorCode::corrupt, "the capabilities name no layers"};
  return service;
}

}  // namespace tellurion::source
