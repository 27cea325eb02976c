// Bytes of GPU memory: how many may be used, and how many are.
#pragma once

#include <cstddef>

namespace tellurion::render {

struct Budget {
  std::size_t limit = 0;
  std::size_t used = 0;

  bool fits(std::size_t bytes) const { return used + bytes <= limit; }
  std::size_t left() const { return used < limit ? limit - used : 0; }
};

}  // namespace tellurion::render
