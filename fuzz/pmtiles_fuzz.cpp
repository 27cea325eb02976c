// PMTiles archives of any bytes: the header and the directories are read or refused, and what they point at lies within.
// rooms: source
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/tiles/pmtiles.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  using namespace tellurion::source;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  (void)pmtiles::read_directory(bytes, pmtiles::Compression::none);
  (void)pmtiles::read_directory(bytes, pmtiles::Compression::gzip);
  const auto header = pmtiles::read_header(bytes, size);
  if (!header) {
    if (header.error().message.empty()) std::abort();
    return 0;
  }
  const auto inside = [&](const fetch::ByteRange& range) { return range.offset <= size && range.length <= size - range.offset; };
  if (!inside(header->root) || !inside(header->leaves) || !inside(header->tiles)) std::abort();
  const auto root = pmtiles::read_directory(bytes.substr(header->root.offset, header->root.length), header->directories);
  if (!root) return 0;
  for (const std::uint64_t number : {pmtiles::number_of({header->min_zoom, 0, 0}), root->front().first_tile, root->back().first_tile, ~std::uint64_t{0}}) {
    const auto entry = pmtiles::find(*root, number);
    if (!entry) continue;
    if (entry->first_tile > number) std::abort();
    const auto place = pmtiles::place_of(*entry, *header);
    if (place && !inside(*place)) std::abort();
  }
  return 0;
}
