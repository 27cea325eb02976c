// The life of one part (geometry or colour) of a surface tile, as the cut sees it.
// What happens between fetching and resident (decoded, built, uploaded) is the loader's business: it changes nothing here.
#pragma once

#include <chrono>
#include <variant>

#include "surface/tile_content.h"

namespace tellurion::surface {

using TimePoint = std::chrono::steady_clock::time_point;

/// Not there, nobody works on it.
struct Wanted {};
/// A loader works on it.
struct Fetching {};
/// On the GPU. The numbers are those of the geometry; a colour part leaves them as they are.
struct Resident {
  TileMetrics metrics;
  bool has_slopes = false;
};
/// May be asked for again at `retry_at`.
struct Failed {
  TimePoint retry_at;
};

using PartLife = std::variant<Wanted, Fetching, Resident, Failed>;

/// What can happen to a part.
struct Start {};
struct Cancel {};
struct Arrive {
  Resident content;
};
struct Fail {
  TimePoint retry_at;
};
struct Release {};

using PartEvent = std::variant<Start, Cancel, Arrive, Fail, Release>;

/// The only way from one state to the next. An event that comes too late changes nothing: what is resident stays so until
/// it is released, even while a newer version is fetched in vain; an arrival always wins.
inline PartLife next_life(const PartLife& life, const PartEvent& event) {
  const bool resident = std::holds_alternative<Resident>(life);
  if (const auto* arrival = std::get_if<Arrive>(&event)) return arrival->content;
  if (resident) return std::holds_alternative<Release>(event) ? PartLife(Wanted{}) : life;
  if (std::holds_alternative<Start>(event)) return Fetching{};
  if (const auto* failure = std::get_if<Fail>(&event)) return Failed{failure->retry_at};
  if (std::holds_alternative<Cancel>(event) && std::holds_alternative<Fetching>(life)) return Wanted{};
  return life;
}

/// Whether the part may be asked for at `now`.
inline bool can_request(const PartLife& life, TimePoint now) {
  if (const auto* failure = std::get_if<Failed>(&life)) return failure->retry_at <= now;
  return std::holds_alternative<Wanted>(life);
}

}  // namespace tellurion::surface
