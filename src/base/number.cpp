#include "base/number.h"

#include <charconv>
#include <cmath>
#include <version>

#ifndef __cpp_lib_to_chars
#include <cstdlib>
#include <string>
#endif

namespace tellurion {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  text = trimmed(text);
  std::string_view magnitude = text;
  if (text.starts_with('+') || text.starts_with('-')) magnitude.remove_prefix(1);
  if (text.starts_with('+')) text = magnitude;
  // Shuts out second signs, "inf", "nan" and hexadecimal notation.
  if (magnitude.empty() || magnitude.find_first_not_of("0123456789.eE+-") != std::string_view::npos ||
      (magnitude.front() != '.' && (magnitude.front() < '0' || magnitude.front() > '9'))) {
    return std::nullopt;
  }
#ifdef __cpp_lib_to_chars
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
#else  // the browser's library, whose only locale is "C"
  const std::string copy(text);
  char* end = nullptr;
  const double number = std::strtod(copy.c_str(), &end);
  if (end != copy.c_str() + copy.size() || !std::isfinite(number)) return std::nullopt;
#endif
  return number;
}

}  // namespace tellurion
