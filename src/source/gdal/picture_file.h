// Pictures and grids written to files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "raster/image.h"

namespace tellurion::source {

/// Writes `image` as PNG, whole or not at all. Errors: unavailable, naming the file.
Result<void> write_png(const std::filesystem::path& file, const raster::Image& image);

/// Reads a PNG (or whatever GDAL opens) of 8-bit channels as RGBA. Errors: not_found, corrupt.
Result<raster::Image> read_picture(const std::filesystem::path& file);

/// Writes bands of width * height doubles as a float64 TIFF; `names` describes them. Errors: unavailable, naming the file.
Result<void> write_float64_tiff(const std::filesystem::path& file, int width, int height,
                                std::span<const std::span<const double>> bands, std::span<const std::string> names);

}  // namespace tellurion::source
