// Pictures of heights of any bytes: read or refused with a message, as codes and as numbers.
// rooms: source raster
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "raster/height_codes.h"
#include "source/gdal/picture_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  constexpr int kLargestSide = 256;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const auto picture = source::decode_exact_picture(bytes, kLargestSide);
  if (!picture && picture.error().message.empty()) std::abort();
  if (picture) {
    if (picture->width > kLargestSide || picture->height > kLargestSide) std::abort();
    const auto grid = raster::decode_heights(*picture, raster::HeightCode::terrarium);
    if (grid.metres.size() * 4 != picture->rgba.size()) std::abort();
  }
  const auto band = source::decode_height_band(bytes, kLargestSide);
  if (!band && band.error().message.empty()) std::abort();
  return 0;
}
