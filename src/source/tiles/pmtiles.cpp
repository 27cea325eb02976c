#include "source/tiles/pmtiles.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/gzip.h"

namespace tellurion::source::pmtiles {
namespace {

constexpr std::size_t kMostDirectoryBytes = std::size_t{4} << 20;  ///< unpacked; an entry takes at least four of them

/// Little-endian; the bytes are there.
template <class Number>
Number number_at(std::string_view bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
  return static_cast<Number>(value);
}

fetch::ByteRange range_at(std::string_view bytes, std::size_t at) { return {number_at<std::uint64_t>(bytes, at), number_at<std::uint64_t>(bytes, at + 8)}; }

bool lies_within(const fetch::ByteRange& part, std::uint64_t size) { return part.offset <= size && part.length <= size - part.offset; }

Result<Compression> compression_at(std::string_view bytes, std::size_t at, const char* of) {
  switch (const int code = static_cast<unsigned char>(bytes[at])) {
    case 1: return Compression::none;
    case 2: return Compression::gzip;
    case 3:
    case 4:
      return Error{ErrorCode::unsupported, fmt::format("its {} are compressed by {}, which is not read; convert them to gzip or none", of, code == 3 ? "brotli" : "zstd")};
    default: return Error{ErrorCode::corrupt, fmt::format("its header does not say how its {} are compressed", of)};
  }
}

/// Numbers of seven bits a byte, the least significant first, the highest bit set on all but the last.
class VarintReader {
 public:
  explicit VarintReader(std::string_view bytes) : bytes_(bytes) {}

  /// False at the end of the bytes, or if the number is larger than `most`.
  bool next(std::uint64_t& number, std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) {
    number = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      if (at_ == bytes_.size()) return false;
      const auto byte = static_cast<unsigned char>(bytes_[at_++]);
      const std::uint64_t part = byte & 0x7fu;
      if (shift == 63 && part > 1) return false;
      number |= part << shift;
      if (byte < 0x80) return number <= most;
    }
    return false;
  }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

Result<Directory> decode_directory(std::string_view bytes) {
  constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();
  const Error corrupt{ErrorCode::corrupt, "a directory in it is damaged"};
  VarintReader reader(bytes);
  std::uint64_t count = 0, number = 0, tile = 0;
  if (!reader.next(count) || count == 0 || count > reader.left() / 4) return corrupt;
  Directory directory(static_cast<std::size_t>(count));
  for (Entry& entry : directory) {
    if (!reader.next(number, std::numeric_limits<std::uint64_t>::max() - tile)) return corrupt;
    if (number == 0 && &entry != &directory.front()) return corrupt;  // they ascend
    entry.first_tile = tile += number;
  }
  for (Entry& entry : directory) {
    if (!reader.next(number, kMost32)) return corrupt;
    entry.tiles = static_cast<std::uint32_t>(number);
  }
  for (Entry& entry : directory) {
    if (!reader.next(number, kMost32) || number == 0) return corrupt;
    entry.length = static_cast<std::uint32_t>(number);
  }
  for (std::size_t i = 0; i < directory.size(); ++i) {
    if (!reader.next(number)) return corrupt;
    if (number > 0) {
      directory[i].offset = number - 1;
    } else {  // right behind the one before
      if (i == 0 || directory[i - 1].offset > std::numeric_limits<std::uint64_t>::max() - kMost32) return corrupt;
      directory[i].offset = directory[i - 1].offset + directory[i - 1].length;
    }
  }
  return directory;
}

}  // namespace

Result<Header> read_header(std::string_view bytes, std::uint64_t file_bytes) {
  const auto corrupt = [](std::string what) { return Error{ErrorCode::corrupt, std::move(what)}; };
  if (bytes.size() < kHeaderBytes || !bytes.starts_with("PMTiles")) {
    if (bytes.starts_with("PM")) return Error{ErrorCode::unsupported, "is a PMTiles archive of version 1 or 2, or cut off; `pmtiles convert` makes one of version 3"};
    return corrupt("is no PMTiles archive");
  }
  if (const int version = static_cast<unsigned char>(bytes[7]); version != 3)
    return Error{ErrorCode::unsupported, fmt::format("is a PMTiles archive of version {}; only version 3 is read", version)};

  Header header;
  header.root = range_at(bytes, 8);
  header.metadata = range_at(bytes, 24);
  header.leaves = range_at(bytes, 40);
  header.tiles = range_at(bytes, 56);
  if (header.root.length == 0 || !lies_within(header.root, std::min<std::uint64_t>({kHeadBytes, file_bytes, bytes.size()})) || !lies_within(header.leaves, file_bytes) ||
      !lies_within(header.tiles, file_bytes))
    return corrupt("its header points beyond its end: it is cut off or damaged");
  const Result<Compression> directories = compression_at(bytes, 97, "directories");
  if (!directories) return directories.error();
  header.directories = *directories;
  const int type = static_cast<unsigned char>(bytes[99]);
  if (type == 1) return Error{ErrorCode::unsupported, "holds vector tiles (mvt), which are not drawn; pictures or heights are needed"};
  if (type == 5) return Error{ErrorCode::unsupported, "holds AVIF pictures, which are not read; convert them to JPEG, PNG or WebP"};
  const Result<Compression> contents = compression_at(bytes, 98, "tiles");
  if (!contents) return contents.error();
  header.contents = *contents;
  header.min_zoom = static_cast<unsigned char>(bytes[100]);
  header.max_zoom = static_cast<unsigned char>(bytes[101]);
  if (header.min_zoom > header.max_zoom || header.max_zoom > kDeepestZoom)
    return corrupt(fmt::format("its header says zooms {} to {}; they are from 0 to {}", header.min_zoom, header.max_zoom, kDeepestZoom));
  for (std::size_t i = 0; i < 4; ++i) header.bounds[i] = number_at<std::int32_t>(bytes, 102 + 4 * i) / 1e7;
  return header;
}

Result<Directory> read_directory(std::string_view bytes, Compression compression) {
  if (compression == Compression::none) {
    if (bytes.size() > kMostDirectoryBytes) return Error{ErrorCode::exhausted, "a directory in it is larger than 4 MB"};
    return decode_directory(bytes);
  }
  const Result<std::string> unpacked = gunzip(bytes, kMostDirectoryBytes);
  if (!unpacked) return Error{unpacked.error().code, "a directory in it: " + unpacked.error().message};
  return decode_directory(*unpacked);
}

std::optional<Entry> find(const Directory& directory, std::uint64_t tile) {
  const auto after = std::upper_bound(directory.begin(), directory.end(), tile, [](std::uint64_t t, const Entry& entry) { return t < entry.first_tile; });
  if (after == directory.begin()) return std::nullopt;
  const Entry& entry = *std::prev(after);
  if (entry.tiles > 0 && tile - entry.first_tile >= entry.tiles) return std::nullopt;
  return entry;
}

std::uint64_t number_of(const TileAddress& tile) {
  // Tiles of the zooms before: 1 + 4 + 16 + ...
  std::uint64_t number = ((std::uint64_t{1} << (2 * tile.zoom)) - 1) / 3;
  auto x = static_cast<std::uint64_t>(tile.column), y = static_cast<std::uint64_t>(tile.row);
  // A quadrant at a time: its place on the curve, then its inside turned as the curve runs there.
  for (std::uint64_t side = (std::uint64_t{1} << tile.zoom) >> 1; side > 0; side >>= 1) {
    const bool right = (x & side) != 0, lower = (y & side) != 0;
    number += side * side * (right ? (lower ? 2 : 3) : (lower ? 1 : 0));
    if (lower) continue;
    if (right) {
      x = ~x;
      y = ~y;
    }
    std::swap(x, y);
  }
  return number;
}

Result<fetch::ByteRange> place_of(const Entry& entry, const Header& header) {
  const fetch::ByteRange& within = entry.tiles > 0 ? header.tiles : header.leaves;
  if (!lies_within({entry.offset, entry.length}, within.length)) return Error{ErrorCode::corrupt, "its index points beyond its end: it is cut off or damaged"};
  return fetch::ByteRange{within.offset + entry.offset, entry.length};
}

}  // namespace tellurion::source::pmtiles
