// The question "how high is the ground here?", for rooms that must not know where heights come from.
#pragma once

#include <span>

#include "base/quantity.h"
#include "geo/geodetic.h"

namespace tellurion::geo {

/// Answers at once from what is at hand (never waits for data); finer data may change the answer later.
class HeightQuery {
 public:
  virtual ~HeightQuery() = default;

  /// Height of the ground as displayed (exaggeration included) at each place; 0 where nothing is known.
  /// Requires spans of one size.
  virtual void heights(std::span<const LatLon> places, std::span<EllipsoidalHeight> ground) const = 0;

  EllipsoidalHeight height_at(const LatLon& place) const {
    EllipsoidalHeight ground;
    heights({&place, 1}, {&ground, 1});
    return ground;
  }
};

}  // namespace tellurion::geo
