// Numbers out of text, independent of the locale.
// Thread-safe: pure functions.
#pragma once

#include <optional>
#include <string_view>

namespace tellurion {

/// The number that the whole of `text` says in decimal notation; blanks around it and a leading + are allowed.
/// Nothing if it says anything else, or no finite number.
std::optional<double> parse_number(std::string_view text);

}  // namespace tellurion
