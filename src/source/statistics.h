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
  double share_there = 0;            ///< of the samples within the bounds: all but no-data, and the transparent ones of a picture
  std::vector<BandStatistics> bands; ///< metres above the world's ellipsoid; or red, green, blue from 0 to 255; or grey alone
};

inline constexpr double kMostRemoteSamples = 1 << 20;  ///< of a raster on a server: sixteen tiles of 256 x 256

/// Reads the finest level of at most `most_samples` within the bounds, or the coarsest. What is on a server is waited for.
/// Errors: those of reading; unavailable (the server is too slow).
Result<RasterStatistics> statistics_of(const RasterSource& source, double most_samples);

}  // namespace tellurion::source
