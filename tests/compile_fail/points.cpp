// Positions of different frames have no difference.
#include "geo/frames.h"

int main() {
  using namespace tellurion::geo;
  const Point<Ecef> place{{1.0, 2.0, 3.0}};
  const Point<CameraRelative> seen{{1.0, 2.0, 3.0}};
#ifdef MISUSE
  const Vector<Ecef> offset = place - seen;
#else
  const Vector<Ecef> offset = place - Point<Ecef>{seen.xyz};
#endif
  return offset == Vector<Ecef>{} ? 0 : 1;
}
