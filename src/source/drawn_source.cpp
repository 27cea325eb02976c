#include "source/drawn_source.h"

#include <span>
#include <utility>

#include <fmt/format.h>

#include "source/grid_coverage.h"

namespace tellurion::source {
namespace {

constexpr int kCoarsestSide = 256;  ///< the last level fits into this

class DrawnReader final : public RasterReader {
 public:
  DrawnReader(std::shared_ptr<const Drawing> drawing, PixelMapping mapping) : drawing_(std::move(drawing)), mapping_(std::move(mapping)) {}

  Result<raster::HeightGrid> read_heights(int, const PixelWindow&) override {
    return Error{ErrorCode::unsupported, fmt::format("{} is a picture and has no heights", drawing_->name)};
  }
  Result<raster::Image> read_colours(int level, const PixelWindow& window) override { return drawing_->draw(level, window); }
  void to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) override { mapping_.to_pixels(places, pixels); }
  void to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) override { mapping_.to_places(pixels, places); }

 private:
  std::shared_ptr<const Drawing> drawing_;
  PixelMapping mapping_;
};

class DrawnSource final : public RasterSource {
 public:
  DrawnSource(std::shared_ptr<const Drawing> drawing, RasterDescription description, GridCoverage coverage, const geo::Ellipsoid& world)
      : drawing_(std::move(drawing)), description_(std::move(description)), coverage_(std::move(coverage)), world_(world) {}

  const RasterDescription& description() const override { return description_; }
  const Coverage& coverage() const override { return coverage_; }
  std::string revision() const override { return drawing_->name; }
  Result<std::unique_ptr<RasterReader>> open_reader() const override {
    Result<PixelMapping> mapping = PixelMapping::create(drawing_->georeference, world_);
    if (!mapping) return mapping.error();
    return std::unique_ptr<RasterReader>(std::make_unique<DrawnReader>(drawing_, std::move(*mapping)));
  }

 private:
  std::shared_ptr<const Drawing> drawing_;
  RasterDescription description_;
  GridCoverage coverage_;
  geo::Ellipsoid world_;
};

}  // namespace

std::vector<LevelSize> halved_levels(LevelSize full) {
  std::vector<LevelSize> levels{full};
  while (levels.back().width > kCoarsestSide || levels.back().height > kCoarsestSide)
    levels.push_back({(levels.back().width + 1) / 2, (levels.back().height + 1) / 2});
  return levels;
}

Result<std::unique_ptr<RasterSource>> open_drawing(Drawing drawing, const geo::Ellipsoid& world) {
  Result<PixelMapping> mapping = PixelMapping::create(drawing.georeference, world);
  if (!mapping) return Error{mapping.error().code, fmt::format("{}: {}", drawing.name, mapping.error().message)};
  RasterDescription about;
  about.name = drawing.name;
  about.kind = SampleKind::colour;
  about.levels = drawing.levels;
  about.wraps = mapping->wraps();
  about.band_count = 4;
  about.sample_type = "Byte";
  about.crs_name = mapping->facts().name;
  about.crs_wkt = drawing.georeference.crs;
  about.ellipsoid = mapping->facts().ellipsoid;
  const ToPlaces to_places = [&](std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) { mapping->to_places(pixels, places); };
  const PixelRange range{glm::dvec2(0.0), glm::dvec2(about.levels.front().width, about.levels.front().height)};
  about.bounds = bounds_of(range, to_places);
  about.spacing = spacing_at(0.5 * range.upper, world, to_places);
  GridCoverage coverage(range, world, to_places);
  return std::unique_ptr<RasterSource>(std::make_unique<DrawnSource>(std::make_shared<const Drawing>(std::move(drawing)), std::move(about),
                                                                     std::move(coverage), world));
}

}  // namespace tellurion::source
