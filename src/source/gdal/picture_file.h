// Pictures and grids written to files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "raster/height_grid.h"
#include "raster/image.h"

namespace tellurion::source {

/// Writes `image` as PNG, whole or not at all. Errors: unavailable, naming the file.
Result<void> write_png(const std::filesystem::path& file, const raster::Image& image);

/// Reads a PNG (or whatever GDAL opens) of 8-bit channels as RGBA. Errors: not_found, corrupt.
Result<raster::Image> read_picture(const std::filesystem::path& file);

/// A picture out of the bytes of a file: JPEG, PNG, WebP, GeoTIFF and what else GDAL opens from memory; not premultiplied by alpha.
/// Palettes and greys become colours. Reads at most `largest_side` pixels on a side. Errors: corrupt, exhausted (larger);
/// messages say what is wrong, not where.
Result<raster::Image> decode_picture(const std::string& bytes, int largest_side);

/// Likewise a picture whose colours must be exact, as those that code heights. Errors also: unsupported (compressed with loss).
Result<raster::Image> decode_exact_picture(const std::string& bytes, int largest_side);

/// The first band of such bytes as heights, no-data values, declared or of 16 bits undeclared, as NaN. Errors likewise.
Result<raster::HeightGrid> decode_height_band(const std::string& bytes, int largest_side);

/// Writes bands of width * height doubles as a float64 TIFF; `names` describes them. Errors: unavailable, naming the file.
Result<void> write_float64_tiff(const std::filesystem::path& file, int width, int height,
                                std::span<const std::span<const double>> bands, std::span<const std::string> names);

}  // namespace tellurion::source
