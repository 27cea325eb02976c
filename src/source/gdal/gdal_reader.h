// Reads windows of a GDAL data set as heights and colours.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "source/gdal/gdal_layout.h"
#include "source/gdal/gdal_runtime.h"
#include "source/gdal/remote_blocks.h"
#include "source/gdal/remote_mount.h"
#include "source/proj/vertical_datum.h"

namespace tellurion::source {

class GdalReader final : public RasterReader {
 public:
  /// Opens the layout's file anew; a remote one with the first read. Errors: as opening; unavailable if the file has changed since.
  static Result<std::unique_ptr<GdalReader>> open(std::shared_ptr<const GdalLayout> layout);

  Result<raster::HeightGrid> read_heights(int level, const PixelWindow& window) override;
  Result<raster::Image> read_colours(int level, const PixelWindow& window) override;
  void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) override { mapping_.to_pixels(places, pixels); }
  void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) override { mapping_.to_places(pixels, places); }
  Awaited take_awaited() override;

 private:
  struct Range {
    double low = 0.0;
    double high = 255.0;
  };

  GdalReader(std::shared_ptr<const GdalLayout> layout, PixelMapping mapping, std::optional<VerticalDatum> datum);

  Result<void> open_again();
  Result<void> begin();
  void end(const Error* error);

  GDALRasterBand& band(int number, int overview) const;
  Result<void> read_samples(GDALRasterBand& from, const PixelWindow& window, std::vector<double>& samples) const;
  Result<raster::HeightGrid> heights_of_overview(int overview, const PixelWindow& window) const;
  Result<raster::Image> colours_of_overview(int overview, const PixelWindow& window) const;
  Result<void> find_ranges();
  template <class Data, class Read>
  Result<Data> averaged(int level, const PixelWindow& window, const Read& read) const;

  std::shared_ptr<const GdalLayout> layout_;
  Awaited awaited_;                       ///< outlives the mount
  std::unique_ptr<RemoteMount> mount_;    ///< of a remote file; outlives the data set
  GDALDatasetUniquePtr dataset_;          ///< none: a part of it could not be read, it has to be opened again
  std::unique_ptr<RemoteBlocks> blocks_;  ///< of a remote file
  PixelMapping mapping_;
  std::optional<VerticalDatum> datum_;
  std::vector<Range> ranges_;  ///< of the colour bands: what is black and white; empty until needed
};

}  // namespace tellurion::source
