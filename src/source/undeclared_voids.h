// What rasters of heights hold where they have no data and name no value for it.
// Thread-safe: pure functions.
#pragma once

#include <algorithm>

#include "geo/ellipsoid.h"

namespace tellurion::source {

/// Metres: what is higher or deeper is no data.
inline double height_limit(const geo::Ellipsoid& world) { return std::max(0.015 * world.a(), 30'000.0); }

/// Whether a sample of signed 16-bit numbers, which name no value for "no data", is one of those that commonly stand for it.
inline bool is_int16_void(double sample) { return sample <= -32767.0; }

}  // namespace tellurion::source
