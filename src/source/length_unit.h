// The names that rasters give to units of length.
// Thread-safe: pure functions.
#pragma once

#include <optional>
#include <string_view>

namespace tellurion::source {

/// Metres of the unit, whatever the case of its letters; nothing if the name is of no length that we know.
std::optional<double> metres_of_unit(std::string_view name);

}  // namespace tellurion::source
