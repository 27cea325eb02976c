// A height above mean sea level is no height above the ellipsoid.
#include "geo/geodetic.h"

int main() {
  using namespace tellurion;
  const GeoidHeight above_sea(100.0);
  const EllipsoidalHeight undulation(47.0);
#ifdef MISUSE
  const EllipsoidalHeight height = above_sea + undulation;
#else
  const EllipsoidalHeight height = EllipsoidalHeight(above_sea.value) + undulation;
#endif
  return height.value > 0.0 ? 0 : 1;
}
