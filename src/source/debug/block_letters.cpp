#include "source/debug/block_letters.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>

namespace tellurion::source {
namespace {

struct Letter {
  char sign;
  std::array<const char*, kLetterHeight> rows;
};

constexpr Letter kLetters[] = {
    {'0', {" ### ", "#   #", "#  ##", "# # #", "##  #", "#   #", " ### "}},
    {'1', {"  #  ", " ##  ", "# #  ", "  #  ", "  #  ", "  #  ", "#####"}},
    {'2', {" ### ", "#   #", "    #", "   # ", "  #  ", " #   ", "#####"}},
    {'3', {"#####", "   # ", "  #  ", "   # ", "    #", "#   #", " ### "}},
    {'4', {"   # ", "  ## ", " # # ", "#  # ", "#####", "   # ", "   # "}},
    {'5', {"#####", "#    ", "#### ", "    #", "    #", "#   #", " ### "}},
    {'6', {"  ## ", " #   ", "#    ", "#### ", "#   #", "#   #", " ### "}},
    {'7', {"#####", "    #", "   # ", "  #  ", "  #  ", " #   ", " #   "}},
    {'8', {" ### ", "#   #", "#   #", " ### ", "#   #", "#   #", " ### "}},
    {'9', {" ### ", "#   #", "#   #", " ####", "    #", "   # ", " ##  "}},
    {'/', {"    #", "    #", "   # ", "  #  ", " #   ", "#    ", "#    "}},
    {'.', {"     ", "     ", "     ", "     ", "     ", " ##  ", " ##  "}},
    {'k', {"#    ", "#    ", "#  # ", "# #  ", "##   ", "# #  ", "#  # "}},
    {'m', {"     ", "     ", "## # ", "# # #", "# # #", "# # #", "#   #"}},
};

}  // namespace

bool is_inked(std::string_view text, int column, int row) {
  if (row < 0 || row >= kLetterHeight || column < 0 || column >= text_width(text)) return false;
  const int within = column % kLetterStep;
  if (within == kLetterWidth) return false;
  const char sign = text[static_cast<std::size_t>(column / kLetterStep)];
  const auto* letter = std::find_if(std::begin(kLetters), std::end(kLetters), [&](const Letter& l) { return l.sign == sign; });
  return letter != std::end(kLetters) && letter->rows[static_cast<std::size_t>(row)][within] == '#';
}

bool is_inked_nearby(std::string_view text, int column, int row) {
  for (int y = row - 1; y <= row + 1; ++y) {
    for (int x = column - 1; x <= column + 1; ++x) {
      if (is_inked(text, x, y)) return true;
    }
  }
  return false;
}

}  // namespace tellurion::source
