#include "source/tiles/tiled_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "base/frozen.h"
#include "raster/box_average.h"
#include "source/gdal/picture_file.h"
#include "source/grid_coverage.h"
#include "source/proj/pixel_mapping.h"
#include "source/proj/raise_heights.h"
#include "source/proj/vertical_datum.h"
#include "source/tiles/tile_template.h"

namespace tellurion::source {
namespace {

constexpr int kCoarsestSide = 256;             ///< the last level fits into this
constexpr std::int64_t kMostPixels = 1 << 30;  ///< of level 0, on a side
constexpr int kLargestTile = 4096;             ///< pixels on a side
constexpr std::size_t kHeldTiles = 8;          ///< decoded, by a reader
constexpr int kMostAveraged = 4;               ///< levels below min_zoom that are made of its tiles; further ones are void

/// What is found once at opening, shared by all readers.
struct TileLayout {
  TileService service;
  TileTemplate address;
  std::string key_prefix;     ///< of caches' keys
  RasterDescription description;
  Georeference georeference;
  geo::Ellipsoid world;
  PixelRange range;           ///< of level 0: what there is
  std::string vertical;       ///< what VerticalDatum::create takes; empty: heights are above the ellipsoid already
  std::shared_ptr<fetch::ByteStore> store;

  std::int64_t columns(int zoom) const { return std::int64_t{service.scheme == TileScheme::geographic ? 2 : 1} << zoom; }
  std::int64_t rows(int zoom) const { return std::int64_t{1} << zoom; }
};

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

class TileReader final : public RasterReader {
 public:
  TileReader(std::shared_ptr<const TileLayout> layout, PixelMapping mapping, std::optional<VerticalDatum> datum)
      : layout_(std::move(layout)), mapping_(std::move(mapping)), datum_(std::move(datum)) {}

  Result<raster::HeightGrid> read_heights(int level, const PixelWindow& window) override {
    Result<raster::HeightGrid> grid = read<raster::HeightGrid>(level, window);
    if (grid && datum_) raise_to_ellipsoid(*grid, layout_->description, level, window, mapping_, *datum_);
    return grid;
  }
  Result<raster::Image> read_colours(int level, const PixelWindow& window) override { return read<raster::Image>(level, window); }
  void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) override { mapping_.to_pixels(places, pixels); }
  void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) override { mapping_.to_places(pixels, places); }
  Awaited take_awaited() override { return std::exchange(awaited_, {}); }

 private:
  template <class Data>
  struct Held {
    TileAddress address;
    Frozen<Data> tile;  ///< none: there is no such tile
  };

  template <class Data>
  std::vector<Held<Data>>& held() {
    if constexpr (std::is_same_v<Data, raster::Image>) return images_;
    else return grids_;
  }

  template <class Data>
  Result<Data> decode(const std::string& bytes) const;
  template <class Data>
  Result<Frozen<Data>> tile(const TileAddress& address);
  template <class Data>
  Result<void> put_tile(const TileAddress& address, const PixelWindow& window, Data& out);
  template <class Data>
  Result<Data> assemble(int zoom, const PixelWindow& window);
  template <class Data>
  Result<Data> read(int level, const PixelWindow& window);

  std::shared_ptr<const TileLayout> layout_;
  PixelMapping mapping_;
  std::optional<VerticalDatum> datum_;
  Awaited awaited_;
  std::vector<Held<raster::Image>> images_;  ///< the last tiles used, the most recent first
  std::vector<Held<raster::HeightGrid>> grids_;
};

template <class Data>
Result<Data> TileReader::decode(const std::string& bytes) const {
  const TileService& service = layout_->service;
  Result<Data> tile = Error{};
  if constexpr (std::is_same_v<Data, raster::Image>) {
    tile = decode_picture(bytes, kLargestTile);
    if (tile) premultiply(*tile);
  } else if (service.code) {
    const Result<raster::Image> picture = decode_picture(bytes, kLargestTile);
    tile = picture ? Result<Data>(raster::decode_heights(*picture, *service.code)) : Result<Data>(picture.error());
  } else {
    tile = decode_height_band(bytes, kLargestTile);
  }
  if (tile && (tile->width != service.tile_size || tile->height != service.tile_size))
    return Error{ErrorCode::corrupt, fmt::format("is a tile of {} x {} pixels, not of {}; the source's tile_size says that", tile->width, tile->height, service.tile_size)};
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
  const TileLayout& layout = *layout_;
  const std::string url = layout.address.url(address, layout.rows(address.zoom));
  const fetch::Request request{url, layout.service.headers, fmt::format("{}/{}/{}/{}", layout.key_prefix, address.zoom, address.column, address.row), {}};
  fetch::Asked asked = layout.store->ask(request, -static_cast<double>(address.zoom));
  if (auto* arrival = std::get_if<std::shared_ptr<fetch::Arrival>>(&asked)) {
    awaited_.push_back(std::move(*arrival));
    return Error{ErrorCode::pending, fetch::public_part(url)};
  }
  if (auto* error = std::get_if<Error>(&asked)) return *error;
  const fetch::File& file = std::get<fetch::File>(asked);
  Frozen<Data> tile;
  if (file.bytes && !file.bytes->empty()) {
    Result<Data> decoded = decode<Data>(*file.bytes);
    if (!decoded) {
      const bool page = file.content_type.starts_with("text/");
      const std::string why = fmt::format("{}: {}{}", fetch::public_part(url), decoded.error().message, page ? " (a page of text; is the URL right?)" : "");
      layout.store->reject(request.key, why);
      return Error{ErrorCode::unavailable, why};
    }
    tile = freeze(std::move(*decoded));
  }
  if (kept.size() == kHeldTiles) kept.pop_back();
  kept.insert(kept.begin(), Held<Data>{address, tile});
  return tile;
}

/// Fills the part of `out`, a window of the tile's zoom, that the tile covers: from the tile or from the finest there is above it.
template <class Data>
Result<void> TileReader::put_tile(const TileAddress& address, const PixelWindow& window, Data& out) {
  const int side = layout_->service.tile_size;
  const auto left = static_cast<int>(address.column * side), top = static_cast<int>(address.row * side);
  const int x0 = std::max(left, window.x), x1 = std::min(left + side, window.x + window.width);
  const int y0 = std::max(top, window.y), y1 = std::min(top + side, window.y + window.height);
  const double scale = std::ldexp(1.0, layout_->service.max_zoom - address.zoom);
  const PixelRange& range = layout_->range;
  if (x0 * scale >= range.upper.x || x1 * scale <= range.lower.x || y0 * scale >= range.upper.y || y1 * scale <= range.lower.y) return {};
  for (TileAddress above = address; above.zoom >= layout_->service.min_zoom; above = {above.zoom - 1, above.column / 2, above.row / 2}) {
    Result<Frozen<Data>> found = tile<Data>(above);
    if (!found) return found.error();
    if (!*found) continue;
    const int up = address.zoom - above.zoom;
    for (int y = y0; y < y1; ++y) {
      if (up == 0) {
        copy_row(**found, x0 - left, y - top, out, x0 - window.x, y - window.y, x1 - x0);
        continue;
      }
      for (int x = x0; x < x1; ++x) {
        const glm::dvec2 at = glm::dvec2(std::ldexp(x + 0.5, -up), std::ldexp(y + 0.5, -up)) - glm::dvec2(above.column, above.row) * static_cast<double>(side);
        put_sample(**found, at, out, x - window.x, y - window.y);
      }
    }
    return {};
  }
  return {};
}

template <class Data>
Result<Data> TileReader::assemble(int zoom, const PixelWindow& window) {
  const int side = layout_->service.tile_size;
  Data out = void_of(window, static_cast<const Data*>(nullptr));
  bool pending = false;
  for (int row = window.y / side; row * side < window.y + window.height; ++row) {
    for (int column = window.x / side; column * side < window.x + window.width; ++column) {
      const Result<void> put = put_tile(TileAddress{zoom, column, row}, window, out);
      if (!put && put.error().code == ErrorCode::pending) pending = true;  // the others are asked for too
      else if (!put) return put.error();
    }
  }
  if (pending) return Error{ErrorCode::pending, layout_->description.name};
  return out;
}

template <class Data>
Result<Data> TileReader::read(int level, const PixelWindow& window) {
  const TileService& service = layout_->service;
  const int zoom = service.max_zoom - level;
  if (zoom >= service.min_zoom) return assemble<Data>(zoom, window);
  const int down = service.min_zoom - zoom;
  if (down > kMostAveraged) return void_of(window, static_cast<const Data*>(nullptr));
  const double step = std::exp2(down);
  const int factor = 1 << down;
  raster::BoxAverage average({window.width, window.height, window.x * step, window.y * step, step, step});
  const LevelSize size = layout_->description.levels[static_cast<std::size_t>(level - down)];
  const PixelWindow fine{window.x * factor, window.y * factor, std::min(window.width * factor, size.width - window.x * factor),
                         std::min(window.height * factor, size.height - window.y * factor)};
  const Result<Data> samples = assemble<Data>(service.min_zoom, fine);
  if (!samples) return samples.error();
  average.add(*samples, fine.x, fine.y);
  if constexpr (std::is_same_v<Data, raster::Image>) return average.image();
  else return average.heights();
}

class TiledSource final : public RasterSource {
 public:
  TiledSource(std::shared_ptr<const TileLayout> layout, GridCoverage coverage) : layout_(std::move(layout)), coverage_(std::move(coverage)) {}

  const RasterDescription& description() const override { return layout_->description; }
  const Coverage& coverage() const override { return coverage_; }
  std::string revision() const override { return layout_->key_prefix; }
  Result<std::unique_ptr<RasterReader>> open_reader() const override {
    Result<PixelMapping> mapping = PixelMapping::create(layout_->georeference, layout_->world);
    if (!mapping) return mapping.error();
    std::optional<VerticalDatum> datum;
    if (!layout_->vertical.empty()) {
      Result<VerticalDatum> made = VerticalDatum::create(layout_->vertical);
      if (!made) return made.error();
      datum = std::move(*made);
    }
    return std::unique_ptr<RasterReader>(std::make_unique<TileReader>(layout_, std::move(*mapping), std::move(datum)));
  }

 private:
  std::shared_ptr<const TileLayout> layout_;
  GridCoverage coverage_;
};

Result<void> check(const TileService& service) {
  const auto invalid = [](const std::string& what) { return Error{ErrorCode::invalid_argument, what}; };
  if (service.tile_size < 16 || service.tile_size > kLargestTile) return invalid(fmt::format("tile_size = {}: it is from 16 to {}", service.tile_size, kLargestTile));
  if (service.min_zoom < 0 || service.max_zoom < service.min_zoom)
    return invalid(fmt::format("min_level = {} and max_level = {}: 0 <= min_level <= max_level", service.min_zoom, service.max_zoom));
  const std::int64_t across = std::int64_t{service.scheme == TileScheme::geographic ? 2 : 1} * service.tile_size;
  if (service.max_zoom > 30 || (across << service.max_zoom) > kMostPixels) return invalid(fmt::format("max_level = {} is deeper than can be shown", service.max_zoom));
  return {};
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_tiles(const TileService& service, const geo::Ellipsoid& world,
                                                 std::shared_ptr<fetch::ByteStore> store) {
  const std::string name = fetch::without_credentials(service.url);
  const auto naming = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", name, error.message)}; };
  if (const Result<void> checked = check(service); !checked) return naming(checked.error());
  Result<TileTemplate> address = TileTemplate::parse(service.url, service.subdomains);
  if (!address) return naming(address.error());

  auto layout = std::make_shared<TileLayout>();
  layout->service = service;
  layout->address = std::move(*address);
  layout->key_prefix = name;
  layout->world = world;
  layout->store = std::move(store);
  RasterDescription& about = layout->description;
  const int side = service.tile_size;
  for (int zoom = service.max_zoom; zoom >= 0; --zoom)
    about.levels.push_back({static_cast<int>(layout->columns(zoom) * side), static_cast<int>(layout->rows(zoom) * side)});
  while (about.levels.back().width > kCoarsestSide) about.levels.push_back({(about.levels.back().width + 1) / 2, (about.levels.back().height + 1) / 2});

  const LevelSize full = about.levels.front();
  const bool mercator = service.scheme == TileScheme::web_mercator;
  const double half = mercator ? std::numbers::pi * geo::kWgs84.a() : 180.0;
  const double pixel = 2.0 * half / full.width;
  // A planetary body's longitudes and latitudes go by its own radii.
  const std::string geographic = fmt::format("+proj=longlat +a={:.3f} +b={:.3f} +no_defs", world.a(), world.b());
  const bool on_earth = std::abs(world.a() / geo::kWgs84.a() - 1.0) <= 0.01;
  if (mercator && !on_earth) return naming({ErrorCode::unsupported, "projection = \"web-mercator\" is a map of the Earth; tiles of another body are \"geographic\""});
  layout->georeference = {mercator ? "EPSG:3857" : on_earth ? "OGC:CRS84" : geographic,
                          {-half, pixel, 0.0, mercator ? half : 90.0, 0.0, -pixel}, full.width, full.height};

  Result<PixelMapping> mapping = PixelMapping::create(layout->georeference, world);
  if (!mapping) return naming(mapping.error());
  about.name = name;
  about.kind = service.kind;
  about.is_remote = true;
  about.wraps = mapping->wraps();
  about.band_count = service.kind == SampleKind::height ? 1 : 4;
  about.sample_type = service.kind == SampleKind::height && !service.code ? "Float32" : "Byte";
  about.crs_name = mapping->facts().name;
  about.crs_wkt = layout->georeference.crs;
  about.ellipsoid = mapping->facts().ellipsoid;
  about.vertical = service.vertical.value_or(kEllipsoidDatum);
  about.vertical_declared = service.vertical.has_value();
  if (service.kind == SampleKind::height) {
    if (about.vertical != kEllipsoidDatum) {
      if (!on_earth) return naming({ErrorCode::invalid_argument, fmt::format("vertical = \"{}\" is a datum of the Earth; here only \"ellipsoid\" can be", about.vertical)});
      if (const Result<VerticalDatum> datum = VerticalDatum::create(about.vertical); !datum) return naming(datum.error());
      layout->vertical = about.vertical;
    } else if (!service.vertical) {
      about.hints.push_back(fmt::format("{} declares no vertical datum: its heights are taken as above the ellipsoid, which can be 100 m off; "
                                        "say vertical = \"ellipsoid\", \"egm96\" or another in the world file.", name));
    }
  }
  const ToPlaces to_places = [&](std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) { mapping->to_places(pixels, places); };
  const glm::dvec2 size(full.width, full.height);
  layout->range = {glm::dvec2(0.0), size};
  if (service.bounds) {
    const auto place = [](double latitude, double longitude) { return geo::LatLon{to_radians(Degrees(latitude)), to_radians(Degrees(longitude))}; };
    const auto [west, south, east, north] = *service.bounds;
    const double steepest = mercator ? 85.05 : 90.0;
    const std::array<geo::LatLon, 2> corners{place(std::min(north, steepest), west), place(std::max(south, -steepest), east)};
    std::array<glm::dvec2, 2> pixels;
    mapping->to_pixels(corners, pixels);
    // Longitude 180 is column 0 again.
    layout->range = {glm::max(pixels[0], glm::dvec2(0.0)), glm::dvec2(east >= 180.0 ? size.x : pixels[1].x, std::min(pixels[1].y, size.y))};
    if (layout->range.lower.x >= layout->range.upper.x || layout->range.lower.y >= layout->range.upper.y)
      return naming({ErrorCode::invalid_argument, "its bounds hold nothing: they are [west, south, east, north] in degrees, within -180 to 180 and the map"});
  }
  about.bounds = bounds_of(layout->range, to_places);
  about.spacing = spacing_at(0.5 * (layout->range.lower + layout->range.upper), world, to_places);
  GridCoverage coverage(layout->range, world, to_places);
  return std::unique_ptr<RasterSource>(std::make_unique<TiledSource>(std::move(layout), std::move(coverage)));
}

}  // namespace tellurion::source
