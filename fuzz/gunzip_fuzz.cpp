// Gzip files of any bytes: unpacked within the bound or refused with a message.
// rooms: base
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/gzip.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMostBytes = 100'000;
  const auto unpacked = tellurion::gunzip({reinterpret_cast<const char*>(data), size}, kMostBytes);
  if (unpacked ? unpacked->size() > kMostBytes : unpacked.error().message.empty()) std::abort();
  return 0;
}
