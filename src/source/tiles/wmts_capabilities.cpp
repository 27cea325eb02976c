#include "source/tiles/wmts_capabilities.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "source/tiles/bounded_xml.h"

namespace tellurion::source {
namespace {

constexpr std::int64_t kMostTiles = std::int64_t{1} << 40;  ///< of a matrix on a side
constexpr int kLargestTile = 4096;

std::optional<TileMatrix> read_matrix(const pugi::xml_node& node) {
  TileMatrix matrix;
  matrix.identifier = child_text(node, "Identifier");
  matrix.scale_denominator = child_number(node, "ScaleDenominator").value_or(0);
  const auto corner = two_numbers(child_text(node, "TopLeftCorner"));
  const auto count = [&](const char* name, std::int64_t most) {
    const auto number = child_count(node, name);
    return number && *number <= most ? *number : std::int64_t{0};
  };
  matrix.tile_width = static_cast<int>(count("TileWidth", kLargestTile));
  matrix.tile_height = static_cast<int>(count("TileHeight", kLargestTile));
  matrix.columns = count("MatrixWidth", kMostTiles);
  matrix.rows = count("MatrixHeight", kMostTiles);
  const bool whole = corner && matrix.scale_denominator > 0 && matrix.tile_width > 0 && matrix.tile_height > 0 && matrix.columns > 0 && matrix.rows > 0;
  if (!whole || matrix.identifier.empty()) return std::nullopt;
  matrix.corner = {corner->first, corner->second};
  return matrix;
}

TileMatrixSet read_matrix_set(const pugi::xml_node& node) {
  TileMatrixSet set{child_text(node, "Identifier"), child_text(node, "SupportedCRS"), {}};
  for (const pugi::xml_node& matrix : children(node, "TileMatrix")) {
    if (auto read = read_matrix(matrix)) set.matrices.push_back(std::move(*read));
  }
  return set;
}

WmtsLayer::MatrixSetLink read_link(const pugi::xml_node& node) {
  WmtsLayer::MatrixSetLink link{child_text(node, "TileMatrixSet"), {}};
  for (const pugi::xml_node& limits : children(child(node, "TileMatrixSetLimits"), "TileMatrixLimits")) {
    const auto least_row = child_count(limits, "MinTileRow"), most_row = child_count(limits, "MaxTileRow");
    const auto least_column = child_count(limits, "MinTileCol"), most_column = child_count(limits, "MaxTileCol");
    if (!least_row || !most_row || !least_column || !most_column) continue;
    link.limits.push_back({child_text(limits, "TileMatrix"), *least_row, *most_row, *least_column, *most_column});
  }
  return link;
}

WmtsLayer::Dimension read_dimension(const pugi::xml_node& node) {
  WmtsLayer::Dimension dimension{child_text(node, "Identifier"), child_text(node, "Default"), {}};
  for (const pugi::xml_node& value : children(node, "Value")) dimension.values.push_back(text_of(value));
  if (dimension.standard.empty() && !dimension.values.empty()) dimension.standard = dimension.values.back();
  return dimension;
}

std::optional<std::array<double, 4>> read_bounds(const pugi::xml_node& box) {
  const auto lower = two_numbers(child_text(box, "LowerCorner")), upper = two_numbers(child_text(box, "UpperCorner"));
  if (!lower || !upper || !(lower->first < upper->first && lower->second < upper->second)) return std::nullopt;
  return std::array{lower->first, lower->second, upper->first, upper->second};
}

WmtsLayer read_layer(const pugi::xml_node& node) {
  WmtsLayer layer;
  layer.identifier = child_text(node, "Identifier");
  layer.bounds = read_bounds(child(node, "WGS84BoundingBox"));
  for (const pugi::xml_node& style : children(node, "Style")) {
    const std::string is_default = attribute(style, "isDefault");
    layer.styles.push_back({child_text(style, "Identifier"), is_default == "true" || is_default == "1"});
  }
  for (const pugi::xml_node& format : children(node, "Format")) layer.formats.push_back(text_of(format));
  for (const pugi::xml_node& link : children(node, "TileMatrixSetLink")) layer.links.push_back(read_link(link));
  for (const pugi::xml_node& dimension : children(node, "Dimension")) {
    layer.dimensions.push_back(read_dimension(dimension));
    if (layer.dimensions.back().identifier.empty()) layer.dimensions.pop_back();
  }
  for (const pugi::xml_node& resource : children(node, "ResourceURL")) {
    if (attribute(resource, "resourceType") == "tile") layer.resources.push_back({attribute(resource, "format"), attribute(resource, "template")});
  }
  return layer;
}

bool takes_parameters(const pugi::xml_node& get) {
  std::vector<std::string> encodings;
  for (const pugi::xml_node& constraint : children(get, "Constraint")) {
    if (attribute(constraint, "name") != "GetEncoding") continue;
    for (const pugi::xml_node& value : children(child(constraint, "AllowedValues"), "Value")) encodings.push_back(text_of(value));
  }
  return encodings.empty() || std::find(encodings.begin(), encodings.end(), "KVP") != encodings.end();
}

/// Where GetTile with parameters goes: an address that says that it takes them, or one that does not say what it takes.
std::string get_tile_address(const pugi::xml_node& root) {
  for (const pugi::xml_node& operation : children(child(root, "OperationsMetadata"), "Operation")) {
    if (attribute(operation, "name") != "GetTile") continue;
    for (const pugi::xml_node& dcp : children(operation, "DCP")) {
      for (const pugi::xml_node& get : children(child(dcp, "HTTP"), "Get")) {
        if (takes_parameters(get)) return attribute(get, "href");
      }
    }
  }
  return {};
}

}  // namespace

const WmtsLayer* WmtsCapabilities::find_layer(std::string_view identifier) const {
  const auto found = std::find_if(layers.begin(), layers.end(), [&](const WmtsLayer& l) { return l.identifier == identifier; });
  return found == layers.end() ? nullptr : &*found;
}

const TileMatrixSet* WmtsCapabilities::find_matrix_set(std::string_view identifier) const {
  const auto found = std::find_if(matrix_sets.begin(), matrix_sets.end(), [&](const TileMatrixSet& s) { return s.identifier == identifier; });
  return found == matrix_sets.end() ? nullptr : &*found;
}

Result<WmtsCapabilities> parse_wmts_capabilities(std::string_view bytes) {
  const Result<XmlDocument> document = read_xml(bytes);
  if (!document) return document.error();
  if (const auto exception = exception_text(**document)) return Error{ErrorCode::unsupported, "the service says: " + *exception};
  const pugi::xml_node root = (*document)->document_element();
  const pugi::xml_node contents = child(root, "Contents");
  const std::string_view name = local_name(root);
  if (name == "WMS_Capabilities" || name == "WMT_MS_Capabilities")
    return Error{ErrorCode::unsupported, "is a WMS, not a WMTS: its type is \"wms\""};
  if (name != "Capabilities" || !contents)
    return Error{ErrorCode::corrupt, fmt::format("is no capabilities document of a WMTS: its root is <{}>{}", name.substr(0, 60), contents ? "" : ", without <Contents>")};

  WmtsCapabilities service;
  service.title = child_text(child(root, "ServiceIdentification"), "Title");
  service.provider = child_text(child(root, "ServiceProvider"), "ProviderName");
  service.get_tile = get_tile_address(root);
  for (const pugi::xml_node& layer : children(contents, "Layer")) {
    service.layers.push_back(read_layer(layer));
    if (service.layers.back().identifier.empty()) service.layers.pop_back();
  }
  for (const pugi::xml_node& set : children(contents, "TileMatrixSet")) {
    service.matrix_sets.push_back(read_matrix_set(set));
    if (service.matrix_sets.back().matrices.empty() || service.matrix_sets.back().crs.empty()) service.matrix_sets.pop_back();
  }
  if (service.layers.empty()) return Error{ErrorCode::corrupt, "the capabilities name no layers"};
  if (service.matrix_sets.empty()) return Error{ErrorCode::corrupt, "the capabilities hold no usable tile matrix set"};
  return service;
}

}  // namespace tellurion::source
