// Error tables that come with rasters: any bytes behind a right beginning and under a right checksum are read or refused; what is
// read has an answer for every tile.
// rooms: surface
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "base/hash.h"
#include "surface/error_table.h"

namespace {

void append(std::string& bytes, std::uint64_t number) { bytes.append(reinterpret_cast<const char*>(&number), sizeof number); }

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  std::string bytes;
  append(bytes, 0x32'65'6c'62'61'74'6c'74);  // what a file begins with
  append(bytes, 1);
  bytes += "r";
  bytes.append(reinterpret_cast<const char*>(data), size);
  append(bytes, fnv1a(bytes));
  const auto table = surface::ErrorTable::from_bytes(bytes, "r", "fuzz");
  if (!table) {
    if (table.error().message.empty()) std::abort();
    return 0;
  }
  for (std::uint8_t face = 0; face < 6; ++face) {
    for (const std::uint32_t place : {0u, 0x155555u, 0x3fffffu}) {
      const auto found = table->find({face, 22, place, 0x3fffffu - place});
      if (!(found.record.min_height <= found.record.max_height) || !std::isfinite(found.record.error.bound)) std::abort();
    }
  }
  return 0;
}
