#include "source/tiles/tms_resource.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "source/tiles/bounded_xml.h"

namespace tellurion::source {
namespace {

constexpr int kLargestTile = 4096;
constexpr int kDeepest = 40;  ///< orders beyond it make no sense

std::optional<TmsResource::Level> read_level(const pugi::xml_node& node) {
  TmsResource::Level level;
  level.href = attribute(node, "href");
  level.units_per_pixel = attribute_number(node, "units-per-pixel").value_or(0);
  const double order = attribute_number(node, "order").value_or(-1);
  // gdal2tiles 2.1 writes an order -1, of which there are no tiles.
  if (level.href.empty() || !(level.units_per_pixel > 0) || order < 0 || order > kDeepest || order != std::floor(order)) return std::nullopt;
  return level;
}

}  // namespace

Result<TmsResource> parse_tms_resource(std::string_view bytes) {
  const Result<XmlDocument> document = read_xml(bytes);
  if (!document) return document.error();
  const pugi::xml_node root = (*document)->document_element();
  const auto corrupt = [](std::string what) { return Error{ErrorCode::corrupt, std::move(what)}; };
  if (local_name(root) == "TileMapService") {
    std::string hrefs;
    for (const pugi::xml_node& map : children(child(root, "TileMaps"), "TileMap")) {
      if (hrefs.size() < 1000) hrefs += " " + attribute(map, "href");
    }
    return Error{ErrorCode::unsupported, "is a list of maps, not a map: the url is that of one of" + hrefs};
  }
  if (local_name(root) != "TileMap") return corrupt(fmt::format("is no tilemapresource.xml: its root is <{}>, not <TileMap>", local_name(root).substr(0, 60)));

  TmsResource map;
  map.title = child_text(root, "Title");
  map.attribution = child_text(child(root, "Attribution"), "Title");
  map.crs = child_text(root, "SRS");
  const pugi::xml_node box = child(root, "BoundingBox"), origin = child(root, "Origin"), format = child(root, "TileFormat"), sets = child(root, "TileSets");
  map.profile = attribute(sets, "profile");
  const auto west = attribute_number(box, "minx"), south = attribute_number(box, "miny"), east = attribute_number(box, "maxx"), north = attribute_number(box, "maxy");
  const auto x = attribute_number(origin, "x"), y = attribute_number(origin, "y");
  if (!west || !south || !east || !north || !(*west < *east && *south < *north)) return corrupt("<BoundingBox> is missing, or empty");
  if (!x || !y) return corrupt("<Origin> is missing");
  map.box = {*west, *south, *east, *north};
  map.origin = {*x, *y};

  const auto side = [&](const char* name) { return attribute_number(format, name).value_or(256); };
  const double width = side("width"), height = side("height");
  const auto is_size = [](double size) { return size >= 1 && size <= kLargestTile && size == std::floor(size); };
  if (!is_size(width) || !is_size(height)) return corrupt(fmt::format("<TileFormat> says tiles of {} x {} pixels; they have from 1 to {}", width, height, kLargestTile));
  map.tile_width = static_cast<int>(width);
  map.tile_height = static_cast<int>(height);
  map.extension = attribute(format, "extension");
  if (map.extension.starts_with('.')) map.extension.erase(0, 1);
  if (map.extension.empty()) return corrupt("<TileFormat> names no extension");

  for (const pugi::xml_node& set : children(sets, "TileSet")) {
    if (auto level = read_level(set)) map.levels.push_back(std::move(*level));
  }
  std::stable_sort(map.levels.begin(), map.levels.end(), [](const auto& a, const auto& b) { return a.units_per_pixel > b.units_per_pixel; });
  const auto same = std::unique(map.levels.begin(), map.levels.end(), [](const auto& a, const auto& b) { return a.units_per_pixel == b.units_per_pixel; });
  map.levels.erase(same, map.levels.end());
  if (map.levels.empty()) return corrupt("<TileSets> holds no usable <TileSet>");
  return map;
}

}  // namespace tellurion::source
