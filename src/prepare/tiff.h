// TIFF directories, read and written, and the layout of Cloud Optimized GeoTIFFs.
// Thread-safe: pure functions.
// Formats: TIFF 6.0; BigTIFF (https://www.awaresystems.be/imaging/tiff/bigtiff.html);
// COG: https://gdal.org/drivers/raster/cog.html, "File layout details".
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"

namespace tellurion::prepare {

struct TiffField {
  std::uint16_t tag = 0;
  std::uint16_t type = 0;
  std::uint64_t count = 0;
  std::vector<std::byte> value;  ///< little-endian
};

using TiffDirectory = std::vector<TiffField>;  ///< ascending by tag

constexpr std::uint16_t kTileOffsetsTag = 324;
constexpr std::uint16_t kTileByteCountsTag = 325;

/// A field of one number of 32 bits.
TiffField long_field(std::uint16_t tag, std::uint32_t value);

/// The field of that tag; nothing if it is not there.
const TiffField* find_field(const TiffDirectory& directory, std::uint16_t tag);

/// Puts the field in, in place of one of the same tag.
void set_field(TiffDirectory& directory, TiffField field);

/// The numbers of a field of whole numbers.
std::vector<std::uint64_t> numbers_of(const TiffField& field);

/// The first directory of a little-endian TIFF file that is no BigTIFF. Errors: corrupt, unsupported.
Result<TiffDirectory> read_directory(std::span<const std::byte> file);

/// One level of a COG: its directory without where its blocks are, and how long they are, row by row; 0: there is none.
struct CogLevel {
  TiffDirectory directory;
  std::vector<std::uint32_t> block_bytes;
};

/// All that precedes the blocks, and where the file ends. The blocks follow, the coarsest level's first, row by row, each with a
/// leader (its length in 4 bytes) and a trailer (its last 4 bytes again).
struct CogHead {
  std::vector<std::byte> bytes;
  std::uint64_t file_bytes = 0;
};

constexpr std::uint64_t kBlockFrameBytes = 8;  ///< of leader and trailer

/// Lays the file out: `levels` from the finest on. BigTIFF where it has to be.
CogHead lay_out_cog(const std::vector<CogLevel>& levels);

}  // namespace tellurion::prepare
