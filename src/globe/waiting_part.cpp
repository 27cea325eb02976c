#include "globe/waiting_part.h"

#include <utility>

namespace tellurion::globe {

WaitingPart waiting_part(const geo::TileKey& key, surface::Part part, source::Awaited awaited) {
  WaitingPart waiting{key, part, std::move(awaited), std::make_shared<std::atomic<std::size_t>>(0)};
  *waiting.missing = waiting.awaited.size();
  for (const auto& arrival : waiting.awaited) arrival->then([missing = waiting.missing] { --*missing; });
  return waiting;
}

double gain_of(const WaitingPart& part, double gain_px) {
  constexpr double kUsualBytes = 16384;
  double bytes = 1;
  for (const auto& arrival : part.awaited) {
    if (!arrival->over()) bytes += arrival->expected_bytes() > 0 ? arrival->expected_bytes() : kUsualBytes;
  }
  return gain_px / bytes;
}

}  // namespace tellurion::globe
