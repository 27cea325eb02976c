// Transforms chain only where their frames meet.
#include "geo/frames.h"

int main() {
  using namespace tellurion::geo;
  const Transform<Ecef, Enu> to_ecef;
  const Transform<CameraRelative, Ecef> to_camera;
#ifdef MISUSE
  const auto chain = to_ecef * to_camera;
#else
  const auto chain = to_camera * to_ecef;
#endif
  return chain.translation.x == 0.0 ? 0 : 1;
}
