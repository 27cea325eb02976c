// The axes of a CRS: which comes first, and what they count.
// Thread-safe: a pure function.
#pragma once

#include <string>

#include "base/result.h"

namespace tellurion::source {

struct CrsAxes {
  std::string name;             ///< as PROJ calls the CRS
  bool north_first = false;     ///< the CRS itself gives the coordinate to the north before the one to the east
  bool is_geographic = false;   ///< coordinates are degrees; else `metres_per_unit` counts
  double metres_per_unit = 1.0;
  double radius = 0.0;          ///< metres, of the body's equator
};

/// `crs` is anything that PROJ understands. Errors: invalid_argument (PROJ does not know it), unsupported (its coordinates are
/// neither angles nor lengths in a plane).
Result<CrsAxes> axes_of(const std::string& crs);

}  // namespace tellurion::source
