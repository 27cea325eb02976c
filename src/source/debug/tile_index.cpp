#include "source/debug/tile_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "source/debug/block_letters.h"
#include "source/drawn_source.h"

namespace tellurion::source {
namespace {

constexpr int kSmallestTile = 32;
constexpr int kLargestTile = 1024;
constexpr std::int64_t kMostPixels = 1 << 30;  ///< of level 0, on a side
/// Of borders, by level modulo their number.
constexpr std::array<Ink, 6> kLevelInks{{{230, 60, 60, 255}, {240, 160, 40, 255}, {230, 230, 60, 255}, {70, 200, 80, 255}, {60, 160, 240, 255}, {200, 90, 230, 255}}};

/// Part of a tile, in pixels from the tile's upper left corner.
struct Box {
  int x0, y0, x1, y1;
};

/// What is drawn into one tile of a window.
class TilePainter {
 public:
  /// The tile's upper left corner lies at `left`, `top` of the image, perhaps outside.
  TilePainter(raster::Image& image, int left, int top) : image_(image), left_(left), top_(top) {}

  void fill(const Box& box, const Ink& ink) {
    for (int y = std::max(box.y0 + top_, 0); y < std::min(box.y1 + top_, image_.height); ++y) {
      for (int x = std::max(box.x0 + left_, 0); x < std::min(box.x1 + left_, image_.width); ++x)
        std::copy(ink.begin(), ink.end(), image_.rgba.begin() + static_cast<std::ptrdiff_t>(image_.offset(x, y)));
    }
  }

  void frame(int width, int height, const Ink& ink) {
    for (const auto& [inset, line] : {std::pair{1, ink}, std::pair{0, kBlackInk}}) {
      const Box box{inset, inset, width - inset, height - inset};
      fill({box.x0, box.y0, box.x1, box.y0 + 1}, line);
      fill({box.x0, box.y1 - 1, box.x1, box.y1}, line);
      fill({box.x0, box.y0, box.x0 + 1, box.y1}, line);
      fill({box.x1 - 1, box.y0, box.x1, box.y1}, line);
    }
  }

  /// White with a black rim, a cell being `scale` pixels wide.
  void write(std::string_view text, int x, int y, int scale) {
    for (int row = -1; row <= kLetterHeight; ++row) {
      for (int column = -1; column <= text_width(text); ++column) {
        if (!is_inked_nearby(text, column, row)) continue;
        const Box cell{x + column * scale, y + row * scale, x + (column + 1) * scale, y + (row + 1) * scale};
        fill(cell, is_inked(text, column, row) ? kWhiteInk : kBlackInk);
      }
    }
  }

 private:
  raster::Image& image_;
  int left_;
  int top_;
};

/// Pixels to a cell at which a line of text fits into `room` pixels, its rim included.
int scale_of(std::string_view text, int room) { return room / (text_width(text) + 2); }

/// On one line, or where that has no room on three; nothing where these have none either.
void label(TilePainter& painter, int width, int height, int zoom, std::int64_t column, std::int64_t row) {
  constexpr int kMargin = 6;  // border lines and some air
  const int most = std::max(height / 48, 1);
  std::vector<std::string> lines{fmt::format("{}/{}/{}", zoom, column, row)};
  int scale = std::min(scale_of(lines.front(), width - kMargin), most);
  if (scale == 0) {
    lines = {std::to_string(zoom), std::to_string(column), std::to_string(row)};
    scale = most;
    for (const std::string& line : lines) scale = std::min(scale, scale_of(line, width - kMargin));
  }
  const int step = (kLetterHeight + 2) * scale, all = step * static_cast<int>(lines.size());
  if (scale == 0 || all > height - kMargin) return;
  int y = (height - all) / 2 + scale;
  for (const std::string& line : lines) {
    painter.write(line, (width - text_width(line) * scale) / 2, y, scale);
    y += step;
  }
}

/// How a level of the raster is cut into tiles; levels beyond the coarsest one's show its tiles smaller.
struct IndexLevel {
  int zoom = 0;
  std::int64_t columns = 1;
  std::int64_t rows = 1;
  LevelSize size;

  int left_of(std::int64_t column) const { return static_cast<int>(column * size.width / columns); }
  int top_of(std::int64_t row) const { return static_cast<int>(row * size.height / rows); }
};

raster::Image draw(const IndexLevel& level, const PixelWindow& window) {
  raster::Image image{window.width, window.height, {}};
  image.rgba.assign(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * 4, 0);
  const std::int64_t first_row = std::int64_t{window.y} * level.rows / level.size.height;
  const std::int64_t first_column = std::int64_t{window.x} * level.columns / level.size.width;
  for (std::int64_t row = first_row; row < level.rows && level.top_of(row) < window.y + window.height; ++row) {
    for (std::int64_t column = first_column; column < level.columns && level.left_of(column) < window.x + window.width; ++column) {
      const int left = level.left_of(column), top = level.top_of(row);
      const int width = level.left_of(column + 1) - left, height = level.top_of(row + 1) - top;
      TilePainter painter(image, left - window.x, top - window.y);
      label(painter, width, height, level.zoom, column, row);
      painter.frame(width, height, kLevelInks[static_cast<std::size_t>(level.zoom) % kLevelInks.size()]);
    }
  }
  return image;
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_tile_index(const TileIndexOptions& options, const geo::Ellipsoid& world) {
  const int side = options.tile_size;
  if (side < kSmallestTile || side > kLargestTile)
    return Error{ErrorCode::invalid_argument, fmt::format("a tile index has tiles of {} to {} pixels, not of {}", kSmallestTile, kLargestTile, side)};
  const bool on_earth = std::abs(world.a() / geo::kWgs84.a() - 1.0) <= 0.01;
  if (!options.geographic && !on_earth)
    return Error{ErrorCode::unsupported, "a tile index in \"web-mercator\" is one of the Earth's; other bodies have projection = \"geographic\""};
  const int across = options.geographic ? 2 : 1;
  int deepest = 0;
  while ((std::int64_t{across} * side << (deepest + 1)) <= kMostPixels) ++deepest;

  Drawing drawing;
  drawing.name = fmt::format("tile index ({}, {} pixels)", options.geographic ? "geographic" : "web-mercator", side);
  std::vector<IndexLevel> levels;
  drawing.levels = halved_levels({static_cast<int>(std::int64_t{across} * side << deepest), static_cast<int>(std::int64_t{side} << deepest)});
  for (std::size_t i = 0; i < drawing.levels.size(); ++i) {
    const int zoom = std::max(deepest - static_cast<int>(i), 0);
    levels.push_back({zoom, std::int64_t{across} << zoom, std::int64_t{1} << zoom, drawing.levels[i]});
  }
  const LevelSize full = drawing.levels.front();
  const double half = options.geographic ? 180.0 : std::numbers::pi * geo::kWgs84.a();
  const double pixel = 2.0 * half / full.width;
  drawing.georeference = {options.geographic ? geographic_crs(world) : "EPSG:3857",
                          {-half, pixel, 0.0, options.geographic ? 90.0 : half, 0.0, -pixel}, full.width, full.height};
  drawing.draw = [levels = std::move(levels)](int level, const PixelWindow& window) { return draw(levels[static_cast<std::size_t>(level)], window); };
  return open_drawing(std::move(drawing), world);
}

}  // namespace tellurion::source
