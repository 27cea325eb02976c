#include "source/tiles/tile_pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "source/gdal/picture_file.h"
#include "source/grid_coverage.h"
#include "source/proj/pixel_mapping.h"
#include "source/proj/projection.h"
#include "source/proj/vertical_datum.h"
#include "source/tiles/archive_tile.h"
#include "source/tiles/tile_reader.h"

namespace tellurion::source {
namespace {

constexpr int kCoarsestSide = 256;            ///< the last level fits into this
constexpr double kMostPixels = 1 << 30;       ///< of level 0, on a side
constexpr double kNearly = 1.0 + 1e-9;

class PyramidSource final : public RasterSource {
 public:
  PyramidSource(std::shared_ptr<const PyramidLayout> layout, GridCoverage coverage) : layout_(std::move(layout)), coverage_(std::move(coverage)) {}

  const RasterDescription& description() const override { return layout_->description; }
  const Coverage& coverage() const override { return coverage_; }
  /// With all that makes other heights of the same tiles.
  std::string revision() const override {
    const TilePyramid& pyramid = layout_->pyramid;
    std::string text = pyramid.revision.empty() ? pyramid.name : pyramid.revision;
    if (!pyramid.encoding.empty()) text += fmt::format("|encoding={}", pyramid.encoding);
    if (pyramid.vertical) text += fmt::format("|vertical={}", *pyramid.vertical);
    if (pyramid.bounds) text += fmt::format("|bounds={}", fmt::join(*pyramid.bounds, ","));
    return text;
  }
  Result<std::unique_ptr<RasterReader>> open_reader() const override {
    Result<PixelMapping> mapping = PixelMapping::create(layout_->georeference, layout_->world);
    if (!mapping) return mapping.error();
    std::optional<VerticalDatum> datum;
    if (!layout_->vertical.empty()) {
      Result<VerticalDatum> made = VerticalDatum::create(layout_->vertical, layout_->world);
      if (!made) return made.error();
      datum = std::move(*made);
    }
    return std::unique_ptr<RasterReader>(std::make_unique<TileReader>(layout_, std::move(*mapping), std::move(datum)));
  }

 private:
  std::shared_ptr<const PyramidLayout> layout_;
  GridCoverage coverage_;
};

/// Pixels that the finest level has of the map: tiles may reach beyond the body.
glm::dvec2 pixels_of(const TileGrid& grid, const Projection& projection) {
  const TileLevel& finest = grid.levels.back();
  glm::dvec2 pixels = glm::dvec2(finest.columns, finest.rows) * glm::dvec2(grid.tile_width, grid.tile_height);
  if (const auto period = projection.period()) {
    if (pixels.x * finest.pixel.x > *period * kNearly) pixels.x = std::round(*period / finest.pixel.x);
    const bool degrees = std::abs(*period - 360.0) < 1e-6;
    const double below = (finest.corner.y + 90.0) / finest.pixel.y;
    if (degrees && below > 0.0 && pixels.y > below * kNearly) pixels.y = std::round(below);
  }
  return pixels;
}

/// Halved again and again. A map that does not go round the body is a little larger, so that all halves are whole.
std::vector<LevelSize> level_sizes(glm::dvec2 pixels, bool goes_round) {
  int halvings = 0;
  while (std::max(pixels.x, pixels.y) > std::ldexp(kCoarsestSide, halvings)) ++halvings;
  const double unit = goes_round ? 1.0 : std::ldexp(1.0, halvings);
  glm::dvec2 size = glm::max(glm::ceil(pixels / unit), glm::dvec2(1.0)) * unit;
  std::vector<LevelSize> levels;
  for (int level = 0; level <= halvings; ++level, size = glm::ceil(0.5 * size)) levels.push_back({static_cast<int>(size.x), static_cast<int>(size.y)});
  return levels;
}

/// Takes `bounds` to pixels of level 0.
Result<PixelRange> range_of(const std::array<double, 4>& bounds, glm::dvec2 size, PixelMapping& mapping, const ToPlaces& to_places) {
  const PixelRange all{glm::dvec2(0.0), size};
  const auto [west, south, east, north] = bounds;
  const geo::GeodeticBounds own = bounds_of(all, to_places);
  const auto latitude = [&](double degrees) { return std::clamp(to_radians(Degrees(degrees)).value, own.south.value, own.north.value); };
  // The outline, since in most projections no two corners bound it.
  constexpr int kSteps = 512;  // of a parallel round a pole these lie within 2e-5 of its radius
  std::vector<geo::LatLon> outline;
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const Radians along = to_radians(Degrees(west + share * (east - west)));
    const Radians up(latitude(south) + share * (latitude(north) - latitude(south)));
    outline.push_back({Radians(latitude(south)), along});
    outline.push_back({Radians(latitude(north)), along});
    outline.push_back({up, to_radians(Degrees(west))});
    outline.push_back({up, to_radians(Degrees(east))});
  }
  std::vector<glm::dvec2> pixels(outline.size());
  mapping.to_pixels(outline, pixels);
  PixelRange range{size, glm::dvec2(0.0)};
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (std::isnan(pixels[i].x) || std::isnan(pixels[i].y)) return all;
    // Where columns go round, the eastern edge may be column 0 again.
    if (mapping.wraps() && east >= 180.0 && outline[i].longitude.value >= to_radians(Degrees(180.0)).value) pixels[i].x = size.x;
    range.lower = glm::min(range.lower, pixels[i]);
    range.upper = glm::max(range.upper, pixels[i]);
  }
  range = {glm::clamp(range.lower, glm::dvec2(0.0), size), glm::clamp(range.upper, glm::dvec2(0.0), size)};
  if (range.lower.x >= range.upper.x || range.lower.y >= range.upper.y)
    return Error{ErrorCode::invalid_argument, "its bounds hold nothing: they are [west, south, east, north] in degrees, within -180 to 180 and the map"};
  return range;
}

/// Of heights: what they are above. Returns what VerticalDatum::create takes; nothing for the ellipsoid.
/// A vertical part of the CRS counts unless `vertical` says otherwise.
Result<std::string> find_datum(const std::optional<std::string>& vertical, const CrsFacts& facts, const geo::Ellipsoid& world, RasterDescription& about) {
  std::string wanted = vertical.value_or(facts.vertical.empty() || facts.vertical == kEllipsoidDatum ? facts.vertical : about.crs_wkt);
  if (wanted == kSphereDatum) wanted = sphere_datum(facts.ellipsoid.equatorial_radius);
  about.vertical = kEllipsoidDatum;
  about.vertical_declared = !wanted.empty();
  if (wanted == kEllipsoidDatum || about.kind != SampleKind::height) return std::string();
  if (wanted.empty()) {
    about.hints.push_back(fmt::format("{} declares no vertical datum: its heights are taken as above the ellipsoid, which can be 100 m off; "
                                      "say vertical = \"ellipsoid\", \"egm96\" or another in the world file.", about.name));
    return std::string();
  }
  if (const Result<VerticalDatum> datum = VerticalDatum::create(wanted, world); !datum) return datum.error();
  about.vertical = wanted == about.crs_wkt ? facts.vertical : wanted;
  return wanted;
}

}  // namespace

HeightDecoder picture_heights(std::optional<raster::HeightCode> code) {
  if (!code) return [](const std::string& bytes, const TileAddress&) { return decode_height_band(bytes, kLargestTile); };
  return [code = *code](const std::string& bytes, const TileAddress&) -> Result<raster::HeightGrid> {
    const Result<raster::Image> picture = decode_exact_picture(bytes, kLargestTile);
    if (!picture) return picture.error();
    return raster::decode_heights(*picture, code);
  };
}

Result<std::unique_ptr<RasterSource>> open_pyramid(TilePyramid pyramid, const geo::Ellipsoid& world) {
  const auto naming = [name = pyramid.name](const Error& error) { return Error{error.code, fmt::format("{}: {}", name, error.message)}; };
  assert(pyramid.supply && (pyramid.kind != SampleKind::height || pyramid.decode_heights));
  TileGrid& grid = pyramid.grid;
  if (grid.levels.empty()) return naming({ErrorCode::invalid_argument, "has no levels of tiles"});
  if (grid.crs == "EPSG:3857" && !is_earth(world))
    return naming({ErrorCode::unsupported, "projection = \"web-mercator\" is a map of the Earth; tiles of another body are \"geographic\""});

  Result<Projection> projection = Projection::create(grid.crs, world, grid.levels.back().corner);
  if (!projection) return naming(projection.error());
  glm::dvec2 pixels = pixels_of(grid, *projection);
  while (std::max(pixels.x, pixels.y) > kMostPixels && grid.levels.size() > 1 && static_cast<int>(grid.levels.size()) - 1 > grid.min_zoom) {
    grid.levels.pop_back();
    pixels = pixels_of(grid, *projection);
  }
  if (!(std::max(pixels.x, pixels.y) <= kMostPixels)) return naming({ErrorCode::unsupported, "its coarsest tiles are finer than can be shown"});

  auto layout = std::make_shared<PyramidLayout>();
  layout->world = world;
  RasterDescription& about = layout->description;
  about.levels = level_sizes(pixels, projection->period().has_value());
  const LevelSize full = about.levels.front();
  const TileLevel& finest = grid.levels.back();
  layout->georeference = {grid.crs, {finest.corner.x, finest.pixel.x, 0.0, finest.corner.y, 0.0, -finest.pixel.y}, full.width, full.height};
  Result<PixelMapping> mapping = PixelMapping::create(layout->georeference, world);
  if (!mapping) return naming(mapping.error());

  about.name = pyramid.name;
  about.kind = pyramid.kind;
  about.is_remote = pyramid.is_remote;
  about.attribution = plain_text(pyramid.attribution);
  about.hints = std::move(pyramid.hints);
  about.wraps = mapping->wraps();
  about.band_count = pyramid.kind == SampleKind::height ? 1 : 4;
  about.sample_type = pyramid.sample_type;
  about.crs_name = mapping->facts().name;
  about.crs_wkt = grid.crs;
  about.ellipsoid = mapping->facts().ellipsoid;
  Result<std::string> datum = find_datum(pyramid.vertical, mapping->facts(), world, about);
  if (!datum) return naming(datum.error());
  layout->vertical = std::move(*datum);

  const ToPlaces to_places = [&](std::span<const glm::dvec2> at, std::span<geo::LatLon> places) { mapping->to_places(at, places); };
  layout->range = {glm::dvec2(0.0), pixels};
  if (pyramid.bounds) {
    Result<PixelRange> range = range_of(*pyramid.bounds, pixels, *mapping, to_places);
    if (!range) return naming(range.error());
    layout->range = *range;
  }
  about.bounds = bounds_of(layout->range, to_places);
  about.spacing = spacing_at(0.5 * (layout->range.lower + layout->range.upper), world, to_places);
  layout->pyramid = std::move(pyramid);
  GridCoverage coverage(layout->range, world, to_places);
  return std::unique_ptr<RasterSource>(std::make_unique<PyramidSource>(std::move(layout), std::move(coverage)));
}

}  // namespace tellurion::source
