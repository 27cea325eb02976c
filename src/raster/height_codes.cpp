#include "raster/height_codes.h"

#include <array>
#include <cstddef>
#include <utility>

namespace tellurion::raster {
namespace {

constexpr std::array<std::pair<std::string_view, HeightCode>, 3> kNames{
    {{"terrarium", HeightCode::terrarium}, {"terrain-rgb", HeightCode::terrain_rgb}, {"centimetres", HeightCode::centimetres}}};

float metres_of(int r, int g, int b, HeightCode code) {
  const int number = r * 65536 + g * 256 + b;
  switch (code) {
    case HeightCode::terrarium:
      return static_cast<float>(number / 256.0 - 32768.0);
    case HeightCode::terrain_rgb:
      return static_cast<float>(number / 10.0 - 10000.0);
    case HeightCode::centimetres:
      return static_cast<float>(number / 1600.0 - 1000.0);
  }
  return kNoHeight;
}

}  // namespace

std::optional<HeightCode> height_code(std::string_view name) {
  for (const auto& [known, code] : kNames) {
    if (known == name) return code;
  }
  return std::nullopt;
}

std::string_view name_of(HeightCode code) {
  for (const auto& [name, known] : kNames) {
    if (known == code) return name;
  }
  return {};
}

HeightGrid decode_heights(const Image& picture, HeightCode code) {
  HeightGrid grid{picture.width, picture.height, {}};
  grid.metres.reserve(picture.rgba.size() / 4);
  for (std::size_t i = 0; i + 3 < picture.rgba.size(); i += 4) {
    const std::uint8_t* pixel = &picture.rgba[i];
    grid.metres.push_back(pixel[3] == 0 ? kNoHeight : metres_of(pixel[0], pixel[1], pixel[2], code));
  }
  return grid;
}

}  // namespace tellurion::raster
