// Windows of a pyramid's levels out of its tiles.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "base/frozen.h"
#include "source/grid_coverage.h"
#include "source/proj/pixel_mapping.h"
#include "source/proj/vertical_datum.h"
#include "source/raster_source.h"
#include "source/tiles/tile_pyramid.h"

namespace tellurion::source {

/// What is found once at opening, shared by all readers.
struct PyramidLayout {
  TilePyramid pyramid;
  RasterDescription description;
  Georeference georeference;
  geo::Ellipsoid world;
  PixelRange range;      ///< of level 0: what there is
  std::string vertical;  ///< what VerticalDatum::create takes; empty: heights are above the ellipsoid already
  mutable std::atomic<double> mean_bytes{0};  ///< of a tile, of those seen so far

  /// The level of the raster as if it were a level of tiles of its own.
  TileLevel level_of_raster(int level) const;
};

class TileReader final : public RasterReader {
 public:
  TileReader(std::shared_ptr<const PyramidLayout> layout, PixelMapping mapping, std::optional<VerticalDatum> datum);

  Result<raster::HeightGrid> read_heights(int level, const PixelWindow& window) override;
  Result<raster::Image> read_colours(int level, const PixelWindow& window) override;
  void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) override;
  void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) override;
  Awaited take_awaited() override;

 private:
  template <class Data>
  struct Held {
    TileAddress address;
    Frozen<Data> tile;  ///< none: there is no such tile
  };
  template <class Data>
  std::vector<Held<Data>>& held();

  template <class Data>
  Result<Data> decode(const std::string& bytes, const TileAddress& address) const;
  template <class Data>
  Result<Frozen<Data>> tile(const TileAddress& address);
  template <class Data>
  Result<void> fill(int zoom, const LevelTransform& to_level, const PixelWindow& part, const PixelWindow& window, Data& out);
  template <class Data>
  Result<Data> assemble(int zoom, const LevelTransform& to_level, const PixelWindow& window);
  template <class Data>
  Result<Data> read(int level, const PixelWindow& window);

  std::shared_ptr<const PyramidLayout> layout_;
  PixelMapping mapping_;
  std::optional<VerticalDatum> datum_;
  Awaited awaited_;
  std::vector<Held<raster::Image>> images_;  ///< the last tiles used, the most recent first
  std::vector<Held<raster::HeightGrid>> grids_;
};

}  // namespace tellurion::source
