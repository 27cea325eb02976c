// What the samples of a raster are like: told to people, not used for drawing.
// Thread-safe: a function of its arguments.
#pragma once

#include <vector>

#include "base/result.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// Of the samples that are there; all NaN if none is.
struct BandStatistics {
  double least = 0;
  double largest = 0;
  double mean = 0;
  double deviation = 0;  ///< standard deviation of the samples themselves
};

struct RasterStatistics {
  int level = 0;                     ///< whose samples they are
  double share_there = 0;            ///< of the samples: all but no-data, and the transparent ones of a picture
  std::vector<BandStatistics> bands; ///< metres above the world's ellipsoid; or red, green, blue from 0 to 255; or grey alone
};

/// Reads the finest level of at most `most_samples`, or the coarsest. Errors: those of reading; unsupported (a raster on a server).
Result<RasterStatistics> statistics_of(const RasterSource& source, double most_samples);

}  // namespace tellurion::source
