#include "source/tiles/tile_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "raster/box_average.h"
#include "source/gdal/picture_file.h"
#include "source/proj/raise_heights.h"
#include "source/undeclared_voids.h"

namespace tellurion::source {
namespace {

constexpr std::size_t kHeldTiles = 8;  ///< decoded, by a reader
constexpr int kMostAveraged = 4;       ///< levels coarser than the coarsest tiles that are made of them; further ones are void

std::size_t area(const PixelWindow& window) { return static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height); }

raster::HeightGrid void_of(const PixelWindow& window, const raster::HeightGrid*) {
  return {window.width, window.height, std::vector<float>(area(window), raster::kNoHeight)};
}
raster::Image void_of(const PixelWindow& window, const raster::Image*) {
  return {window.width, window.height, std::vector<std::uint8_t>(area(window) * 4, 0)};
}

void premultiply(raster::Image& image) {
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const int alpha = image.rgba[i + 3];
    if (alpha == 255) continue;
    for (std::size_t c = 0; c < 3; ++c) image.rgba[i + c] = static_cast<std::uint8_t>((image.rgba[i + c] * alpha + 127) / 255);
  }
}

/// Bilinear value of a tile at continuous pixel coordinates; its outermost samples are continued.
void put_sample(const raster::HeightGrid& tile, glm::dvec2 at, raster::HeightGrid& out, int x, int y) {
  const glm::dvec2 corner = glm::floor(at - 0.5), share = at - 0.5 - corner;
  double sum = 0, valid = 0;
  for (int i = 0; i < 4; ++i) {
    const float metres = tile.at(std::clamp(static_cast<int>(corner.x) + (i & 1), 0, tile.width - 1),
                                 std::clamp(static_cast<int>(corner.y) + (i >> 1), 0, tile.height - 1));
    if (std::isnan(metres)) continue;
    const double weight = ((i & 1) != 0 ? share.x : 1 - share.x) * ((i >> 1) != 0 ? share.y : 1 - share.y);
    sum += weight * static_cast<double>(metres);
    valid += weight;
  }
  out.at(x, y) = valid > 0 ? static_cast<float>(sum / valid) : raster::kNoHeight;
}
void put_sample(const raster::Image& tile, glm::dvec2 at, raster::Image& out, int x, int y) {
  const glm::dvec2 corner = glm::floor(at - 0.5), share = at - 0.5 - corner;
  std::array<double, 4> sum{};
  for (int i = 0; i < 4; ++i) {
    const auto colour = tile.at(std::clamp(static_cast<int>(corner.x) + (i & 1), 0, tile.width - 1),
                                std::clamp(static_cast<int>(corner.y) + (i >> 1), 0, tile.height - 1));
    const double weight = ((i & 1) != 0 ? share.x : 1 - share.x) * ((i >> 1) != 0 ? share.y : 1 - share.y);
    for (std::size_t c = 0; c < 4; ++c) sum[c] += weight * colour[c];
  }
  for (std::size_t c = 0; c < 4; ++c) out.rgba[out.offset(x, y) + c] = static_cast<std::uint8_t>(std::lround(sum[c]));
}

void copy_row(const raster::HeightGrid& tile, int from_x, int from_y, raster::HeightGrid& out, int x, int y, int count) {
  std::memcpy(&out.at(x, y), &tile.metres[static_cast<std::size_t>(from_y) * static_cast<std::size_t>(tile.width) + static_cast<std::size_t>(from_x)],
              static_cast<std::size_t>(count) * sizeof(float));
}
void copy_row(const raster::Image& tile, int from_x, int from_y, raster::Image& out, int x, int y, int count) {
  std::memcpy(&out.rgba[out.offset(x, y)], &tile.rgba[tile.offset(from_x, from_y)], static_cast<std::size_t>(count) * 4);
}

/// `transform` without the rounding of numbers in services' documents, where it says that pixels lie on pixels.
LevelTransform snapped(const LevelTransform& transform, const LevelSize& size) {
  constexpr double kSlack = 0.05;  // pixels
  const glm::dvec2 whole = glm::round(transform.offset);
  const glm::dvec2 drift = glm::abs(transform.scale - 1.0) * glm::dvec2(size.width, size.height) + glm::abs(transform.offset - whole);
  return drift.x < kSlack && drift.y < kSlack ? LevelTransform{glm::dvec2(1.0), whole} : transform;
}

LevelTransform then(const LevelTransform& first, const LevelTransform& second) {
  return {first.scale * second.scale, first.offset * second.scale + second.offset};
}

/// As a whole number between both, which are whole; `least` if it is no number.
double between(double number, double least, double most) { return number >= least ? std::min(std::floor(number), most) : least; }

/// The pixels from `from` up to `to` whose centres map into [lower, upper).
std::pair<int, int> centres_within(double lower, double upper, double scale, double offset, int from, int to) {
  const auto first = [&](double edge) { return static_cast<int>(between(std::ceil((edge - offset) / scale - 0.5), from, to)); };
  return {first(lower), first(upper)};
}

/// Whether each pixel is one of the other level.
bool is_pixel_to_pixel(const LevelTransform& transform) { return transform.scale == glm::dvec2(1.0) && transform.offset == glm::floor(transform.offset); }

}  // namespace

TileLevel PyramidLayout::level_of_raster(int level) const {
  const GeoTransform& t = georeference.transform;
  const LevelSize& full = description.levels.front();
  const LevelSize& size = description.levels[static_cast<std::size_t>(level)];
  return {{t[0], t[3]}, glm::dvec2(t[1], -t[5]) * glm::dvec2(full.width, full.height) / glm::dvec2(size.width, size.height), 0, 0};
}

TileReader::TileReader(std::shared_ptr<const PyramidLayout> layout, PixelMapping mapping, std::optional<VerticalDatum> datum)
    : layout_(std::move(layout)), mapping_(std::move(mapping)), datum_(std::move(datum)) {}

Result<raster::HeightGrid> TileReader::read_heights(int level, const PixelWindow& window) {
  Result<raster::HeightGrid> grid = read<raster::HeightGrid>(level, window);
  if (grid && datum_) raise_to_ellipsoid(*grid, layout_->description, level, window, mapping_, *datum_);
  return grid;
}

Result<raster::Image> TileReader::read_colours(int level, const PixelWindow& window) { return read<raster::Image>(level, window); }
void TileReader::to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) { mapping_.to_pixels(places, pixels); }
void TileReader::to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) { mapping_.to_places(pixels, places); }
Awaited TileReader::take_awaited() { return std::exchange(awaited_, {}); }

template <class Data>
std::vector<TileReader::Held<Data>>& TileReader::held() {
  if constexpr (std::is_same_v<Data, raster::Image>) return images_;
  else return grids_;
}

template <class Data>
Result<Data> TileReader::decode(const std::string& bytes, const TileAddress& address) const {
  const TilePyramid& pyramid = layout_->pyramid;
  Result<Data> tile = Error{};
  if constexpr (std::is_same_v<Data, raster::Image>) {
    tile = decode_picture(bytes, kLargestTile);
    if (tile) premultiply(*tile);
  } else {
    tile = pyramid.decode_heights(bytes, address);
    const double limit = height_limit(layout_->world);
    for (std::size_t i = 0; tile && i < tile->metres.size(); ++i) {
      if (!(std::abs(static_cast<double>(tile->metres[i])) <= limit)) tile->metres[i] = raster::kNoHeight;
    }
  }
  const TileGrid& grid = pyramid.grid;
  if (tile && (tile->width != grid.tile_width || tile->height != grid.tile_height))
    return Error{ErrorCode::corrupt, fmt::format("is a tile of {} x {} pixels, not of {} x {}; the source's tile_size says that", tile->width,
                                                 tile->height, grid.tile_width, grid.tile_height)};
  return tile;
}

/// The tile, decoded; none if there is no such tile.
template <class Data>
Result<Frozen<Data>> TileReader::tile(const TileAddress& address) {
  auto& kept = held<Data>();
  const auto found = std::find_if(kept.begin(), kept.end(), [&](const Held<Data>& h) { return h.address == address; });
  if (found != kept.end()) {
    std::rotate(kept.begin(), found, std::next(found));
    return kept.front().tile;
  }
  const TileSupply& supply = *layout_->pyramid.supply;
  // Until a frame knows better the coarse ones go first, after all that frames have ordered.
  fetch::Asked asked = supply.ask(address, {-static_cast<double>(address.zoom), layout_->mean_bytes});
  if (auto* arrival = std::get_if<std::shared_ptr<fetch::Arrival>>(&asked)) {
    awaited_.push_back(std::move(*arrival));
    return Error{ErrorCode::pending, supply.name_of(address)};
  }
  if (auto* error = std::get_if<Error>(&asked)) return *error;
  const fetch::File& file = std::get<fetch::File>(asked);
  Frozen<Data> tile;
  if (file.bytes && !file.bytes->empty()) {
    constexpr double kNewShare = 0.1;
    const double mean = layout_->mean_bytes, size = static_cast<double>(file.bytes->size());
    layout_->mean_bytes = mean > 0 ? mean + kNewShare * (size - mean) : size;
    Result<Data> decoded = decode<Data>(*file.bytes, address);
    if (!decoded) {
      const bool page = file.content_type.starts_with("text/");
      const std::string why = fmt::format("{}: {}{}", supply.name_of(address), decoded.error().message, page ? " (a page of text; is the URL right?)" : "");
      supply.reject(address, why);
      // A server may mend it; a file is what it is.
      return Error{layout_->pyramid.is_remote ? ErrorCode::unavailable : decoded.error().code, why};
    }
    tile = freeze(std::move(*decoded));
  }
  if (kept.size() == kHeldTiles) kept.pop_back();
  kept.insert(kept.begin(), Held<Data>{address, tile});
  return tile;
}

/// Fills `part` of `window`, pixels of a level that `to_level` takes to those of level `zoom` of tiles: from its tiles, and where one
/// does not exist from the finest above it. What all of this lacks stays void. Errors: pending once all that is there was taken.
template <class Data>
Result<void> TileReader::fill(int zoom, const LevelTransform& to_level, const PixelWindow& part, const PixelWindow& window, Data& out) {
  const TileGrid& grid = layout_->pyramid.grid;
  const TileLevel& level = grid.levels[static_cast<std::size_t>(zoom)];
  const glm::dvec2 side(grid.tile_width, grid.tile_height), s = to_level.scale, o = to_level.offset;
  const auto index = [](double pixel, double size, std::int64_t count) { return static_cast<std::int64_t>(between(pixel / size, -1.0, static_cast<double>(count))); };
  const glm::dvec2 first = to_level(glm::dvec2(part.x, part.y) + 0.5), last = to_level(glm::dvec2(part.x + part.width, part.y + part.height) - 0.5);
  const LevelTransform to_full = transform_between(level, layout_->level_of_raster(0));
  std::optional<Error> pending;
  for (std::int64_t row = std::max<std::int64_t>(index(first.y, side.y, level.rows), 0); row <= std::min(index(last.y, side.y, level.rows), level.rows - 1); ++row) {
    for (std::int64_t column = std::max<std::int64_t>(index(first.x, side.x, level.columns), 0); column <= std::min(index(last.x, side.x, level.columns), level.columns - 1); ++column) {
      const glm::dvec2 lower = glm::dvec2(column, row) * side, upper = lower + side;
      const auto [x0, x1] = centres_within(lower.x, upper.x, s.x, o.x, part.x, part.x + part.width);
      const auto [y0, y1] = centres_within(lower.y, upper.y, s.y, o.y, part.y, part.y + part.height);
      const glm::dvec2 begin = to_full(lower), end = to_full(upper);
      const PixelRange& range = layout_->range;
      const bool beyond = begin.x >= range.upper.x || end.x <= range.lower.x || begin.y >= range.upper.y || end.y <= range.lower.y;
      if (x0 == x1 || y0 == y1 || beyond) continue;
      const Result<Frozen<Data>> found = tile<Data>({zoom, column, row});
      if (!found && found.error().code != ErrorCode::pending) return found.error();
      if (!found) {
        pending = found.error();  // the others are asked for too
      } else if (!*found) {
        if (zoom == grid.min_zoom) continue;
        const LevelTransform up = then(to_level, transform_between(level, grid.levels[static_cast<std::size_t>(zoom - 1)]));
        const Result<void> filled = fill(zoom - 1, up, PixelWindow{x0, y0, x1 - x0, y1 - y0}, window, out);
        if (!filled && filled.error().code != ErrorCode::pending) return filled;
        if (!filled) pending = filled.error();
      } else if (is_pixel_to_pixel(to_level)) {
        const glm::ivec2 from(glm::dvec2(x0, y0) + o - lower);
        for (int y = y0; y < y1; ++y) copy_row(**found, from.x, from.y + y - y0, out, x0 - window.x, y - window.y, x1 - x0);
      } else {
        for (int y = y0; y < y1; ++y) {
          for (int x = x0; x < x1; ++x) put_sample(**found, to_level(glm::dvec2(x, y) + 0.5) - lower, out, x - window.x, y - window.y);
        }
      }
    }
  }
  if (pending) return *pending;
  return {};
}

template <class Data>
Result<Data> TileReader::assemble(int zoom, const LevelTransform& to_level, const PixelWindow& window) {
  Data out = void_of(window, static_cast<const Data*>(nullptr));
  const Result<void> filled = fill(zoom, to_level, window, window, out);
  if (!filled) return filled.error();
  return out;
}

template <class Data>
Result<Data> TileReader::read(int level, const PixelWindow& window) {
  const TileGrid& grid = layout_->pyramid.grid;
  const TileLevel here = layout_->level_of_raster(level);
  constexpr double kSame = 1.0 + 1e-6;
  auto zoom = static_cast<int>(grid.levels.size()) - 1;
  const auto pixel_of = [&](int of) { return grid.levels[static_cast<std::size_t>(of)].pixel; };
  while (zoom > grid.min_zoom && pixel_of(zoom - 1).x <= here.pixel.x * kSame && pixel_of(zoom - 1).y <= here.pixel.y * kSame) --zoom;
  const LevelTransform to_tiles = snapped(transform_between(here, grid.levels[static_cast<std::size_t>(zoom)]), layout_->description.levels[static_cast<std::size_t>(level)]);
  if (is_pixel_to_pixel(to_tiles)) return assemble<Data>(zoom, to_tiles, window);

  const glm::dvec2 step = glm::max(to_tiles.scale, glm::dvec2(1.0));
  if (std::max(step.x, step.y) > (1 << kMostAveraged) * kSame) return void_of(window, static_cast<const Data*>(nullptr));
  const glm::dvec2 corner = to_tiles(glm::dvec2(window.x, window.y));
  const glm::dvec2 end = corner + step * glm::dvec2(window.width, window.height);
  constexpr double kFarthest = 1 << 30;  // no tiles have pixels beyond
  if (!(corner.x >= -kFarthest && corner.y >= -kFarthest && end.x <= kFarthest && end.y <= kFarthest)) return void_of(window, static_cast<const Data*>(nullptr));
  const glm::ivec2 first(glm::floor(corner)), last(glm::ceil(end));
  raster::BoxAverage average({window.width, window.height, corner.x, corner.y, step.x, step.y});
  const Result<Data> samples = assemble<Data>(zoom, LevelTransform{}, {first.x, first.y, last.x - first.x, last.y - first.y});
  if (!samples) return samples.error();
  average.add(*samples, first.x, first.y);
  if constexpr (std::is_same_v<Data, raster::Image>) return average.image();
  else return average.heights();
}

}  // namespace tellurion::source
