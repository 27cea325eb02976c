// From what services say of their tiles to grids of tiles.
// Thread-safe: pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/proj/crs_axes.h"
#include "source/tiles/tile_address.h"
#include "source/tiles/tile_grid.h"
#include "source/tiles/tms_resource.h"
#include "source/tiles/wms_capabilities.h"
#include "source/tiles/wmts_capabilities.h"

namespace tellurion::source {

/// What TileGrid::crs is for coordinates in `crs`: a body other than the Earth has degrees of its own, even where a service
/// calls them EPSG:4326.
std::string grid_crs(const std::string& crs, const CrsAxes& axes, const geo::Ellipsoid& world);

/// The tiles of one level that there are, rows from the north, both ends included.
struct TileRange {
  std::int64_t least_column = 0, most_column = 0, least_row = 0, most_row = 0;
  bool contains(const TileAddress& tile) const {
    return tile.column >= least_column && tile.column <= most_column && tile.row >= least_row && tile.row <= most_row;
  }
};

/// A matrix set as a grid; matrices and ranges by the grid's levels.
struct MatrixGrid {
  TileGrid grid;
  std::vector<std::string> matrices;
  std::vector<TileRange> ranges;
};

/// Matrices without limits are left out where there are limits; so are those whose tiles are not of the size that most have.
/// Corners have the CRS's own order of axes. Not all services keep to it: where the other order alone makes sense it counts.
/// `inside`: coordinates (x right, y up) of a place that the tiles cover, if one is known.
/// Errors: unsupported (nothing is left).
Result<MatrixGrid> matrix_grid(const TileMatrixSet& set, const std::vector<TileMatrixLimits>& limits, const CrsAxes& axes, const std::string& crs,
                               std::optional<glm::dvec2> inside);

/// A grid over `box` (minx, miny, maxx, maxy; x right, y up): one tile at level 0, pixels halved from level to level down to
/// `finest_pixel` or 30 levels. Errors: invalid_argument (the box is empty, or not of this world).
Result<TileGrid> box_grid(const std::string& crs, const std::array<double, 4>& box, int tile_size, double finest_pixel);

/// The tiles of a map with rows from the south. Where Mercator's extent is written in degrees, or with the axes mixed up, as
/// gdal2tiles did, the profile decides. Errors: unsupported.
struct TmsGrid {
  TileGrid grid;
  std::vector<std::string> hrefs;        ///< by level: see TmsResource::Level
  std::vector<TileRange> ranges;         ///< rows from the north
  std::vector<std::int64_t> south_rows;  ///< by level: the number, from the south, of row 0
  std::optional<std::array<double, 4>> bounds;  ///< degrees, where the extent was written so
};
Result<TmsGrid> tms_grid(const TmsResource& map, const CrsAxes& axes, const std::string& crs);

}  // namespace tellurion::source
