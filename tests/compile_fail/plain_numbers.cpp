// A number without a unit is no quantity.
#include "base/quantity.h"

int main() {
  using namespace tellurion;
#ifdef MISUSE
  const Metres length = 2.0;
#else
  const Metres length(2.0);
#endif
  return length / Metres(1.0) > 1.0 ? 0 : 1;
}
