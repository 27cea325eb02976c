// Pyramids of tiles as rasters: any grid, any encoding, wherever the tiles come from.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "raster/height_codes.h"
#include "raster/height_grid.h"
#include "source/raster_source.h"
#include "source/tiles/tile_grid.h"
#include "source/tiles/tile_supply.h"

namespace tellurion::source {

/// A tile's bytes to its heights in metres, NaN where there is no data. Thread-safe. Errors: corrupt, unsupported.
using HeightDecoder = std::function<Result<raster::HeightGrid>(const std::string& bytes, const TileAddress& tile)>;

/// Of pictures: by `code`, or without one the first band's numbers. Codes in pictures compressed with loss are refused.
HeightDecoder picture_heights(std::optional<raster::HeightCode> code);

struct TilePyramid {
  std::string name;              ///< as messages and caches' keys name it: without credentials
  std::string revision{};        ///< names the tiles' content; empty: the name does
  TileGrid grid;
  SampleKind kind = SampleKind::colour;
  HeightDecoder decode_heights;  ///< for SampleKind::height
  std::string encoding{};        ///< the decoder's name in the world file; counts for RasterSource::revision
  std::string sample_type = "Byte";             ///< for people: "Float32", ...
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees, west < east: nothing lies outside
  std::optional<std::string> vertical;          ///< as GdalOptions::vertical
  bool is_remote = true;
  std::string attribution;       ///< whom to credit; may be HTML
  std::vector<std::string> hints{};  ///< what a user should know of it, as sentences
  std::shared_ptr<const TileSupply> supply;
};

/// A raster of the pyramid's finest level; levels that are too fine to be numbered (beyond 2^30 pixels) are left out. No tile
/// is asked for yet. Readers answer `pending` while tiles are on their way. A tile that does not exist shows what coarser ones
/// hold. Errors: invalid_argument (grid, bounds, vertical datum), those of the projection.
Result<std::unique_ptr<RasterSource>> open_pyramid(TilePyramid pyramid, const geo::Ellipsoid& world);

}  // namespace tellurion::source
