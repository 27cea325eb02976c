// What a WMS says of itself: OGC 01-068r3 (version 1.1.1) and 06-042 (1.3.0), Web Map Service.
// Thread-safe: a pure function, values.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace tellurion::source {

/// A layer; what it does not say itself it inherits: see WmsCapabilities::resolved.
struct WmsLayer {
  struct Box {
    std::string crs;             ///< as written
    std::array<double, 4> edges; ///< minx, miny, maxx, maxy as written: in 1.3.0 x is the CRS's first axis
  };
  int parent = -1;               ///< its place in the list; -1: none
  std::string name;              ///< empty: only a title over others
  std::string attribution;
  std::vector<std::string> crs;  ///< as written
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees
  std::vector<Box> boxes;
  std::vector<std::string> styles;
  std::optional<double> least_scale;  ///< denominators, of pixels of 0.28 mm: it is drawn between them
  std::optional<double> most_scale;
  std::optional<bool> opaque;
};

struct WmsCapabilities {
  bool is_1_3 = true;            ///< else 1.1: how boxes are written
  std::string title;
  std::string get_map;           ///< where to send GetMap
  std::vector<std::string> formats;
  std::optional<int> most_width; ///< pixels of a picture
  std::optional<int> most_height;
  std::vector<WmsLayer> layers;  ///< parents before their children

  const WmsLayer* find_layer(std::string_view name) const;
  /// With what it inherits: CRSs and styles added up; of the rest the nearest.
  WmsLayer resolved(const WmsLayer& layer) const;
};

/// Errors: corrupt (no XML, no capabilities, or nothing in them), unsupported (of something else than a WMS 1.1 or 1.3, or an
/// exception, with its words), exhausted (too large, or layers nested too deeply).
Result<WmsCapabilities> parse_wms_capabilities(std::string_view bytes);

}  // namespace tellurion::source
