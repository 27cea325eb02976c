// Moments in UTC and their notation by ISO 8601.
// Thread-safe: pure functions. Leap seconds do not exist here, as in std::chrono::system_clock.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "base/result.h"

namespace tellurion {

using UtcTime = std::chrono::sys_time<std::chrono::milliseconds>;

/// Reads `2024-06-20`, `2024-06-20T20:51Z`, `2024-06-20T20:51:08.5Z` or `2024-06-20T22:51+02:00`; without a zone: UTC.
/// Digits beyond milliseconds are dropped. Errors: invalid_argument, naming the text and its fault.
Result<UtcTime> parse_utc(std::string_view text);

/// `2024-06-20T20:51:08Z`, with milliseconds only if there are any. Requires a year in 0..9999 (asserted).
std::string format_utc(UtcTime time);

}  // namespace tellurion
