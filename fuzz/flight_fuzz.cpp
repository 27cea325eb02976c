// Flight files: whatever is accepted can be flown, with finite poses, and is read back after writing.
// rooms: view geo
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "view/flight.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::view;
  const auto flight = parse_flight({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!flight) return 0;
  const double duration_s = flight->end_s() - flight->start_s();
  for (int i = 0; i <= 10; ++i) {
    const Pose pose = flight->pose_at(flight->start_s() + duration_s * i / 10.0);
    for (const double number : {pose.position.latitude.value, pose.position.longitude.value, pose.position.height.value,
                                pose.heading.value, pose.pitch.value, pose.roll.value}) {
      if (!std::isfinite(number)) std::abort();
    }
  }
  // One by one: times nearer than a microsecond become the same in writing.
  for (const FlightSample& sample : flight->samples()) {
    if (!parse_flight(format_flight({&sample, 1}), "written")) std::abort();
  }
  return 0;
}
