// Degrees are no radians.
#include "geo/geodetic.h"

int main() {
  using namespace tellurion;
  const Degrees angle(45.0);
#ifdef MISUSE
  const geo::LatLon place{angle, Radians(0.0)};
#else
  const geo::LatLon place{to_radians(angle), Radians(0.0)};
#endif
  return place.latitude > Radians(0.0) ? 0 : 1;
}
