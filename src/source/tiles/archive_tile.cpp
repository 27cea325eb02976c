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
  std::string text;
  bool in_tag = false;
  for (const char c : html) {
    if (text.size() == kMost) break;
    if (c == '<') in_tag = true;
    if (!in_tag && (static_cast<unsigned char>(c) >= ' ' && c != 0x7f)) text += c;
    if (c == '>') in_tag = false;
  }
  while (!text.empty() && text.size() == kMost && (static_cast<unsigned char>(text.back()) & 0x80) != 0) text.pop_back();  // no half a character
  return text;
}

int deepest_zoom(int tile_size) {
  int zoom = 0;
  while (zoom < 30 && (std::int64_t{tile_size} << (zoom + 1)) <= (std::int64_t{1} << 30)) ++zoom;
  return zoom;
}

}  // namespace tellurion::source
