// Heights above a vertical datum (a geoid, a tide gauge; a sphere) -> heights above the ellipsoid of the world.
// Not thread-safe: every reader has its own.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "geo/geodetic.h"

namespace tellurion::source {

/// For a datum that is the ellipsoid itself nothing is needed; callers leave it out.
inline constexpr const char* kEllipsoidDatum = "ellipsoid";

/// The sphere of the raster's own CRS; `sphere_datum` says which that is.
inline constexpr const char* kSphereDatum = "sphere";

/// The definition of a sphere round the body's centre: "sphere RADIUS".
std::string sphere_datum(Metres radius);

class VerticalDatum {
 public:
  /// `definition`: "sphere RADIUS" (metres); of the Earth: "egm84", "egm96", "egm2008", "navd88", or a vertical CRS that PROJ knows
  /// ("EPSG:5773", WKT). Errors: invalid_argument (no vertical CRS; a datum of the Earth for another body; a sphere that is not as large
  /// as the body); unsupported (no way to the ellipsoid: the message names missing grids).
  static Result<VerticalDatum> create(const std::string& definition, const geo::Ellipsoid& world);

  VerticalDatum(VerticalDatum&&) noexcept;
  VerticalDatum& operator=(VerticalDatum&&) noexcept;
  ~VerticalDatum();

  const std::string& name() const;

  /// ellipsoidal height = datum's height * slope() + undulation. Of a sphere within 1.8e-5 of the height on Mars, 6e-6 on Earth: its
  /// radius is not the ellipsoid's normal.
  double slope() const;
  /// NaN where the datum's grids do not reach.
  void undulations(std::span<const geo::LatLon> places, std::span<double> metres);

 private:
  struct State;
  explicit VerticalDatum(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::source
