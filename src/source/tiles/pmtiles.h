// The index of PMTiles archives, version 3: header, directories, numbers of tiles.
// Pure functions; every count and offset in the bytes is checked.
// Format: https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "fetch/transfer.h"
#include "source/tiles/tile_address.h"

namespace tellurion::source::pmtiles {

inline constexpr std::size_t kHeaderBytes = 127;
inline constexpr std::size_t kHeadBytes = 16384;  ///< header and root directory lie within them
inline constexpr int kMostDepth = 4;              ///< directories from the root to the tile
inline constexpr int kDeepestZoom = 26;

enum class Compression : std::uint8_t { none = 1, gzip = 2 };

struct Header {
  fetch::ByteRange root;        ///< the root directory
  fetch::ByteRange metadata;    ///< JSON, compressed as the directories
  fetch::ByteRange leaves;      ///< all leaf directories
  fetch::ByteRange tiles;
  Compression directories = Compression::none;
  Compression contents = Compression::none;
  int min_zoom = 0;
  int max_zoom = 0;
  std::array<double, 4> bounds{};  ///< west, south, east, north in degrees
};

/// Reads the header. `bytes`: the archive's first ones, root directory included. `file_bytes`: of the archive. Errors, to be completed by the archive's name: corrupt (no PMTiles, ranges outside of
/// the file, zooms), unsupported (version 1 or 2, vector tiles, compression by brotli or zstd).
Result<Header> read_header(std::string_view bytes, std::uint64_t file_bytes);

/// One line of a directory.
struct Entry {
  std::uint64_t first_tile = 0;  ///< number of the first tile
  std::uint32_t tiles = 0;       ///< how many in a row share the bytes; 0: the bytes are a further directory
  std::uint32_t length = 0;      ///< bytes
  std::uint64_t offset = 0;      ///< from the begin of the tiles' or the leaf directories' bytes
};
using Directory = std::vector<Entry>;

/// Reads a directory, compressed as the header says. Errors: corrupt, exhausted (more than a million lines).
Result<Directory> read_directory(std::string_view bytes, Compression compression);

/// The line that leads to the tile; none: there is no such tile.
std::optional<Entry> find(const Directory& directory, std::uint64_t tile);

/// The number of a tile: along a Hilbert curve in each zoom, one zoom after the other. Requires a tile of the map, zoom <= kDeepestZoom.
std::uint64_t number_of(const TileAddress& tile);

/// Where in the file the bytes of `entry` are. Errors: corrupt (outside of the header's ranges).
Result<fetch::ByteRange> place_of(const Entry& entry, const Header& header);

}  // namespace tellurion::source::pmtiles
