#include "source/tiles/archive_tile.h"

#include <fmt/format.h>

#include "base/gzip.h"
#include "source/gdal/picture_file.h"
#include "source/tiles/tile_grid.h"

namespace tellurion::source {

Result<int> side_of_tile(const std::string& bytes, const std::string& archive) {
  if (is_gzip(bytes)) return Error{ErrorCode::unsupported, fmt::format("{}: holds vector tiles, which are not drawn; pictures or heights are needed", archive)};
  const Result<raster::HeightGrid> picture = decode_height_band(bytes, kLargestTile);
  if (!picture)
    return Error{ErrorCode::unsupported, fmt::format("{}: its tiles are no JPEG, PNG, WebP, GIF or GeoTIFF pictures ({}); vector tiles are not drawn", archive,
                                                     picture.error().message)};
  if (picture->width != picture->height) return Error{ErrorCode::unsupported, fmt::format("{}: its tiles are not square: {} x {} pixels", archive, picture->width, picture->height)};
  return picture->width;
}

std::string plain_text(const std::string& html) {
  constexpr std::size_t kMost = 500;
  const auto byte_at = [&](std::size_t i) { return i < html.size() ? static_cast<unsigned char>(html[i]) : 0u; };
  std::string text;
  bool in_tag = false;
  for (std::size_t i = 0; i < html.size() && text.size() <= kMost; ++i) {
    const unsigned byte = byte_at(i);
    const bool second_kind = byte == 0xc2 && byte_at(i + 1) >= 0x80 && byte_at(i + 1) < 0xa0;  // control characters beyond ASCII
    if (byte == '<') in_tag = true;
    if (!in_tag && byte >= ' ' && byte != 0x7f && !second_kind) text += html[i];
    if (byte == '>') in_tag = false;
    if (second_kind) ++i;
  }
  if (text.size() <= kMost) return text;
  std::size_t end = kMost;
  while (end > kMost - 3 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;  // no half a character
  text.resize(end);
  return text;
}

int deepest_zoom(int tile_size) {
  int zoom = 0;
  while (zoom < 30 && (std::int64_t{tile_size} << (zoom + 1)) <= (std::int64_t{1} << 30)) ++zoom;
  return zoom;
}

}  // namespace tellurion::source
