// Heights coded as colours of 8 bits a channel.
// Thread-safe: pure functions.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "raster/height_grid.h"
#include "raster/image.h"

namespace tellurion::raster {

/// How a pixel's red, green and blue (R, G, B) make a height in metres. Colours that are a little off, as lossy compression leaves
/// them, are heights that are far off.
enum class HeightCode {
  terrarium,     ///< R * 256 + G + B / 256 - 32768. Source: Mapzen's Joerd, docs/formats.md
  terrain_rgb,   ///< -10000 + (R * 65536 + G * 256 + B) / 10. Source: Mapbox Terrain-RGB v1
  centimetres,   ///< (R * 65536 + G * 256 + B) / 1600 - 1000: centimetres above -1000 m, times 16; up to 9485.75 m
};

/// The name in world files: "terrarium", "terrain-rgb", "centimetres"; nothing for others.
std::optional<HeightCode> height_code(std::string_view name);
std::string_view name_of(HeightCode code);

/// Heights of a picture that is not premultiplied; pixels of alpha 0 are no data.
HeightGrid decode_heights(const Image& picture, HeightCode code);

}  // namespace tellurion::raster
