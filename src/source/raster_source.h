// A georeferenced raster, whatever it comes from: what it is, and how workers read it.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "base/quantity.h"
#include "base/result.h"
#include "fetch/arrival.h"
#include "geo/ellipsoid.h"
#include "geo/tile_key.h"
#include "raster/height_grid.h"
#include "raster/image.h"

namespace tellurion::source {

/// Pixels of one level of a raster; may lie partly outside of it.
struct PixelWindow {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

struct LevelSize {
  int width = 0;
  int height = 0;
};

/// What the samples mean.
enum class SampleKind { height, colour, grey };

/// All that is known of a raster after opening it. Immutable.
struct RasterDescription {
  std::string name;                ///< the path or URL, as errors name it
  SampleKind kind = SampleKind::colour;  ///< what it looks like, unless the world file says otherwise
  std::vector<LevelSize> levels;   ///< level 0 is the full raster; every further one about half of the one before, down to
                                   ///< one that fits into a block. Levels that the file lacks are made when read.
  bool is_remote = false;          ///< its samples come over a network: not to be read as a whole
  bool wraps = false;              ///< columns go round the body: column `width` is column 0 again
  int band_count = 0;
  std::string sample_type;         ///< "Int16", "Byte", ...
  std::string encoding;            ///< how a file keeps its samples, for people: format, compression, blocks, no-data, scale; may be empty
  std::string crs_name;            ///< e.g. "WGS 84 / UTM zone 18N"
  std::string crs_wkt;
  geo::Ellipsoid ellipsoid;        ///< of the raster's own CRS
  std::string vertical;            ///< vertical datum in use: "ellipsoid", "egm96", ...
  bool vertical_declared = false;  ///< false: heights were taken as above the ellipsoid, which can be 100 m off
  geo::GeodeticBounds bounds;      ///< smallest ones that hold the raster
  Metres spacing;                  ///< on the ground between samples, larger axis, in the raster's middle
  std::string attribution;         ///< whom to credit; may be empty
  std::vector<std::string> hints;  ///< sentences that a user should see
};

/// Where a raster lies and how fine it is there. Thread-safe, immutable, cheap enough for the render thread.
class Coverage {
 public:
  virtual ~Coverage() = default;
  /// Whether some of `tile` lies within the raster. May say yes for a tile that just misses it, never no for one that touches.
  virtual bool touches(const geo::TileKey& tile) const = 0;
  /// Ground distance between samples of level 0 under the tile, larger axis; the finest there. Infinite if it touches nothing.
  virtual Metres spacing_under(const geo::TileKey& tile) const = 0;
};

/// Bytes on their way.
using Awaited = std::vector<std::shared_ptr<fetch::Arrival>>;

/// One thread's access to a raster. Not thread-safe; made and used on one worker.
class RasterReader {
 public:
  virtual ~RasterReader() = default;

  /// Heights above the world's ellipsoid (scale, offset and vertical datum applied), NaN where there is no data.
  /// `window` lies wholly within the level. Errors: unavailable, corrupt, naming the file; pending (see take_awaited).
  virtual Result<raster::HeightGrid> read_heights(int level, const PixelWindow& window) = 0;

  /// Colours, premultiplied by alpha; alpha 0 where there is no data. `window` lies wholly within the level.
  virtual Result<raster::Image> read_colours(int level, const PixelWindow& window) = 0;

  /// Continuous pixel coordinates of level 0 (pixel (i, j) covers [i, i+1) x [j, j+1)); NaN where a place cannot be projected.
  /// Longitudes are brought into the raster's own range; with `wraps` x lies in [0, width). Sizes are equal (asserted).
  virtual void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) = 0;

  /// What reads that answered `pending` wait for, since the last call: not to be let go of while it is wanted.
  virtual Awaited take_awaited() { return {}; }

  /// The reverse; NaN where there is no such place.
  virtual void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) = 0;
};

/// A raster that can be read on many threads. Thread-safe, immutable.
class RasterSource {
 public:
  virtual ~RasterSource() = default;
  virtual const RasterDescription& description() const = 0;
  virtual const Coverage& coverage() const = 0;
  /// Names the content: changes when the file does (path, size, modification time). For keys of caches and kept tables.
  virtual std::string revision() const = 0;
  /// A reader for the calling thread. Errors: as opening.
  virtual Result<std::unique_ptr<RasterReader>> open_reader() const = 0;
};

/// Scale from pixels of level 0 to those of `level`, per axis.
inline glm::dvec2 level_scale(const RasterDescription& d, int level) {
  const LevelSize& full = d.levels.front();
  const LevelSize& wanted = d.levels[static_cast<std::size_t>(level)];
  return {static_cast<double>(wanted.width) / full.width, static_cast<double>(wanted.height) / full.height};
}

}  // namespace tellurion::source
