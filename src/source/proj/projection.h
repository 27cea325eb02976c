// A raster's horizontal CRS, as seen from a world: coordinates <-> places.
// Not thread-safe: every thread makes its own.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include <glm/vec2.hpp>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "geo/geodetic.h"

namespace tellurion::source {

/// What a CRS says of itself.
struct CrsFacts {
  std::string name;
  geo::Ellipsoid ellipsoid;
  std::string vertical;  ///< name of the vertical part; "ellipsoid" for a three-dimensional geographic CRS; else empty
};

/// The geographic CRS of a world, east first, as `Projection::create` takes it: longitudes and latitudes by the world's own radii.
std::string geographic_crs(const geo::Ellipsoid& world);

/// Whether the world is the Earth: some projections and vertical datums are the Earth's only.
bool is_earth(const geo::Ellipsoid& world);

class Projection {
 public:
  /// `crs` is anything that PROJ understands (WKT, "EPSG:3857", ...). `centre`: coordinates in the raster's middle; where
  /// PROJ knows several ways to the world's datum, the one that is best there is used throughout.
  ///
  /// On Earth latitudes are those of WGS 84, by PROJ. On other bodies the raster's ellipsoid and the world's share their
  /// centre and axes: latitudes on a sphere are planetocentric, and become planetographic ones of a flattened world.
  /// Errors: invalid_argument (unknown CRS; a CRS of another body); unsupported (no geographic or projected CRS).
  static Result<Projection> create(const std::string& crs, const geo::Ellipsoid& world, glm::dvec2 centre);

  Projection(Projection&&) noexcept;
  Projection& operator=(Projection&&) noexcept;
  ~Projection();

  const CrsFacts& facts() const;

  /// Coordinates in the order (east, north), degrees in a geographic CRS; NaN where there is no such place.
  void to_places(std::span<const glm::dvec2> coordinates, std::span<geo::LatLon> places);
  void to_coordinates(std::span<const geo::LatLon> places, std::span<glm::dvec2> coordinates);

  /// In a cylindrical CRS, by how much the first coordinate grows (or falls, where it counts to the west) round the body.
  std::optional<double> period() const;

 private:
  struct State;
  explicit Projection(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::source
