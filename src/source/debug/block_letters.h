// A tiny alphabet for labels in pictures: digits and a few signs, 5 x 7 cells each.
// Thread-safe: pure functions.
#pragma once

#include <string_view>

namespace tellurion::source {

inline constexpr int kLetterWidth = 5;   ///< cells
inline constexpr int kLetterHeight = 7;
inline constexpr int kLetterStep = kLetterWidth + 1;  ///< from letter to letter

/// Width of a line of text in cells.
constexpr int text_width(std::string_view text) { return text.empty() ? 0 : static_cast<int>(text.size()) * kLetterStep - 1; }

/// Whether the cell at `column`, `row` (from the upper left) of a line of text is inked. False outside of it, and for
/// letters that are not known.
bool is_inked(std::string_view text, int column, int row);

/// Whether the cell or one of its eight neighbours is inked.
bool is_inked_nearby(std::string_view text, int column, int row);

}  // namespace tellurion::source
