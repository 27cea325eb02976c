// Heights above a vertical datum (a geoid, a tide gauge) -> heights above the ellipsoid of WGS 84. Earth only.
// Not thread-safe: every reader has its own.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "base/result.h"
#include "geo/geodetic.h"

namespace tellurion::source {

/// For a datum that is the ellipsoid itself nothing is needed; callers leave it out.
inline constexpr const char* kEllipsoidDatum = "ellipsoid";

class VerticalDatum {
 public:
  /// `definition`: "egm84", "egm96", "egm2008", "navd88", or a vertical CRS that PROJ knows ("EPSG:5773", WKT).
  /// Errors: invalid_argument (no vertical CRS); unsupported (no way to the ellipsoid: the message names missing grids).
  static Result<VerticalDatum> create(const std::string& definition);

  VerticalDatum(VerticalDatum&&) noexcept;
  VerticalDatum& operator=(VerticalDatum&&) noexcept;
  ~VerticalDatum();

  const std::string& name() const;

  /// ellipsoidal height = datum's height * slope() + undulation.
  double slope() const;
  /// NaN where the datum's grids do not reach.
  void undulations(std::span<const geo::LatLon> places, std::span<double> metres);

 private:
  struct State;
  explicit VerticalDatum(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::source
