// A short, stable name for a text: the same on every machine and in every version.
#pragma once

#include <cstdint>
#include <string_view>

namespace tellurion {

/// FNV-1a of 64 bits. Source: http://www.isthe.com/chongo/tech/comp/fnv/
constexpr std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return hash;
}

}  // namespace tellurion
