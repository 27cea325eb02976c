// What a WMTS says of itself: OGC 07-057r7, Web Map Tile Service 1.0.0.
// Thread-safe: a pure function, values.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"

namespace tellurion::source {

/// One level of a matrix set.
struct TileMatrix {
  std::string identifier;
  double scale_denominator = 0;  ///< greater than 0; of pixels of 0.28 mm
  glm::dvec2 corner{};           ///< upper left, in the order in which it is written
  int tile_width = 0;            ///< pixels, 1 to 4096
  int tile_height = 0;
  std::int64_t columns = 0;      ///< in tiles, 1 to 2^40
  std::int64_t rows = 0;
};

struct TileMatrixSet {
  std::string identifier;
  std::string crs;               ///< as written: see crs_name.h
  std::vector<TileMatrix> matrices;
};

/// The tiles of a matrix that a layer has, both ends included.
struct TileMatrixLimits {
  std::string matrix;
  std::int64_t least_row = 0, most_row = 0, least_column = 0, most_column = 0;
};

struct WmtsLayer {
  struct Style {
    std::string identifier;
    bool is_default = false;
  };
  struct MatrixSetLink {
    std::string set;
    std::vector<TileMatrixLimits> limits;  ///< empty: the whole set
  };
  struct Dimension {
    std::string identifier;
    std::string standard;      ///< the default value; if none is declared, the last one; may be empty
    std::vector<std::string> values;
  };
  struct Resource {
    std::string format;
    std::string pattern;       ///< a URL with {TileMatrix} and the like
  };
  std::string identifier;
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees
  std::vector<Style> styles;
  std::vector<std::string> formats;
  std::vector<MatrixSetLink> links;
  std::vector<Dimension> dimensions;
  std::vector<Resource> resources;  ///< of tiles
};

struct WmtsCapabilities {
  std::string title;
  std::string provider;
  std::string get_tile;  ///< where to send GetTile with parameters; empty: nowhere
  std::vector<WmtsLayer> layers;
  std::vector<TileMatrixSet> matrix_sets;

  const WmtsLayer* find_layer(std::string_view identifier) const;
  const TileMatrixSet* find_matrix_set(std::string_view identifier) const;
};

/// Errors: corrupt (no XML, no capabilities, or nothing in them), unsupported (of something else than a WMTS, or an exception,
/// with its words), exhausted (too large). Layers, matrices and sets that make no sense are left out.
Result<WmtsCapabilities> parse_wmts_capabilities(std::string_view bytes);

}  // namespace tellurion::source
