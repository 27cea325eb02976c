// What a tree of tiles says of itself: tilemapresource.xml of OSGeo's Tile Map Service 1.0.0, as gdal2tiles writes it.
// Thread-safe: a pure function, values.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"

namespace tellurion::source {

struct TmsResource {
  struct Level {
    std::string href;          ///< of its tiles: relative to the document, or whole
    double units_per_pixel = 0;  ///< greater than 0
  };
  std::string title;
  std::string attribution;
  std::string crs;             ///< as written; empty if none is
  std::string profile;         ///< "global-mercator", "mercator", "global-geodetic", "geodetic", "local", "none", ...; may be empty
  std::array<double, 4> box{}; ///< minx, miny, maxx, maxy as written, in order
  glm::dvec2 origin{};         ///< as written: the lower left corner of tile (0, 0)
  int tile_width = 256;        ///< pixels, 1 to 4096
  int tile_height = 256;
  std::string extension;       ///< of the files, without a dot
  std::vector<Level> levels;   ///< coarsest first
};

/// Errors: corrupt (no XML, or not all that is needed), unsupported (a list of maps), exhausted (too large).
Result<TmsResource> parse_tms_resource(std::string_view bytes);

}  // namespace tellurion::source
