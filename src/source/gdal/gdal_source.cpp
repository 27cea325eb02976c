#include "source/gdal/gdal_source.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "fetch/remote_file.h"
#include "source/gdal/gdal_layout.h"
#include "source/gdal/gdal_reader.h"
#include "source/gdal/gdal_runtime.h"
#include "source/gdal/remote_mount.h"
#include "source/grid_coverage.h"
#include "source/proj/projection.h"
#include "source/proj/vertical_datum.h"

namespace tellurion::source {
namespace {

class GdalSource final : public RasterSource {
 public:
  GdalSource(std::shared_ptr<const GdalLayout> layout, const PixelRange& reach) : layout_(std::move(layout)), reach_(reach) {}

  const RasterDescription& description() const override { return layout_->description; }
  /// Found when first asked for: it takes most of the time of opening, and the data sets of a catalogue have a footprint instead.
  const Coverage& coverage() const override {
    std::call_once(coverage_once_, [this] {
      Result<PixelMapping> mapping = PixelMapping::create(layout_->georeference, layout_->world);
      assert(mapping);  // it could be made when the raster was opened
      coverage_.emplace(reach_, layout_->world, [&](std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) { mapping->to_places(pixels, places); });
    });
    return *coverage_;
  }
  std::string revision() const override { return layout_->revision; }
  Result<std::unique_ptr<RasterReader>> open_reader() const override {
    Result<std::unique_ptr<GdalReader>> reader = GdalReader::open(layout_);
    if (!reader) return reader.error();
    return std::unique_ptr<RasterReader>(std::move(reader).value());
  }

 private:
  std::shared_ptr<const GdalLayout> layout_;
  PixelRange reach_;
  mutable std::once_flag coverage_once_;
  mutable std::optional<GridCoverage> coverage_;
};

Error naming(const GdalOptions& options, const Error& error) { return {error.code, fmt::format("{}: {}", options.path, error.message)}; }

/// What the file itself says that its heights are above; empty if nothing.
std::string own_vertical(const GdalLayout& layout, const CrsFacts& facts) {
  if (layout.heights.from_centre) return sphere_datum(layout.world.equatorial_radius);
  return facts.vertical.empty() || facts.vertical == kEllipsoidDatum ? facts.vertical : layout.description.crs_wkt;
}

/// Fills in which heights the samples are; what the file says counts unless the options say otherwise.
Result<void> choose_vertical(GdalLayout& layout, const CrsFacts& facts) {
  const GdalOptions& options = layout.options;
  RasterDescription& about = layout.description;
  std::string wanted = options.vertical.value_or(own_vertical(layout, facts));
  if (wanted == kSphereDatum) wanted = sphere_datum(facts.ellipsoid.equatorial_radius);
  about.vertical = kEllipsoidDatum;
  about.vertical_declared = !wanted.empty();
  if (wanted == kEllipsoidDatum || about.kind != SampleKind::height) return {};
  const bool on_earth = is_earth(layout.world);
  if (wanted.empty()) {
    about.hints.push_back(
        on_earth ? fmt::format("{} declares no vertical datum: its heights are taken as above the ellipsoid, which can be 100 m off; "
                               "say vertical = \"ellipsoid\", \"egm96\" or another in a world file.", options.path)
                 : fmt::format("{} declares no vertical datum: its heights are taken as above the planet's ellipsoid; if that is right, "
                               "say vertical = \"ellipsoid\" in a world file.", options.path));
    return {};
  }
  Result<VerticalDatum> datum = VerticalDatum::create(wanted, layout.world);
  if (!datum) return datum.error();
  if (std::abs(datum->slope()) != 1.0) layout.heights.unit = 1.0;  // the datum counts in the samples' unit already
  layout.vertical = wanted;
  about.vertical = wanted == about.crs_wkt ? facts.vertical : wanted;
  return {};
}

/// The raster with one pixel round it (heights reach that far), without what lies beyond a pole of a geographic raster.
PixelRange reach_of(const GdalLayout& layout, PixelMapping& mapping) {
  const glm::dvec2 size(layout.georeference.width, layout.georeference.height);
  PixelRange range{mapping.wraps() ? glm::dvec2(0.0, -1.0) : glm::dvec2(-1.0), mapping.wraps() ? size + glm::dvec2(0.0, 1.0) : size + 1.0};
  const auto is_place = [&](double y) { return std::isfinite(mapping.to_place({size.x / 2, y}).latitude.value); };
  const auto last_place = [&](double inside, double beyond) {
    if (is_place(beyond) || !is_place(inside)) return beyond;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (inside + beyond);
      (is_place(middle) ? inside : beyond) = middle;
    }
    return inside;
  };
  range.lower.y = last_place(size.y / 2, range.lower.y);
  range.upper.y = last_place(size.y / 2, range.upper.y);
  return range;
}

/// A source over what `inspect` has found.
Result<std::unique_ptr<RasterSource>> make_source(GdalLayout inspected) {
  auto layout = std::make_shared<GdalLayout>(std::move(inspected));
  const GdalOptions& options = layout->options;
  const geo::Ellipsoid& world = layout->world;
  Result<PixelMapping> mapping = PixelMapping::create(layout->georeference, world);
  if (!mapping) return naming(options, mapping.error());
  if (Result<void> chosen = choose_vertical(*layout, mapping->facts()); !chosen) return naming(options, chosen.error());

  RasterDescription& about = layout->description;
  about.crs_name = mapping->facts().name;
  about.ellipsoid = mapping->facts().ellipsoid;
  about.wraps = mapping->wraps();
  const ToPlaces to_places = [&](std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) { mapping->to_places(pixels, places); };
  const PixelRange reach = reach_of(*layout, mapping.value());
  const glm::dvec2 size(layout->georeference.width, layout->georeference.height);
  about.bounds = bounds_of({glm::max(reach.lower, glm::dvec2(0.0)), glm::min(reach.upper, size)}, to_places);
  about.spacing = spacing_at(0.5 * size, world, to_places);
  return std::unique_ptr<RasterSource>(std::make_unique<GdalSource>(std::move(layout), reach));
}

/// What a remote raster needs beyond a local one: none of its levels may be made of a large part of the file.
Result<void> suit_for_network(const GdalLayout& layout) {
  constexpr double kMostAveraged = 1 << 23;  // samples
  for (std::size_t level = 0; level < layout.levels.size(); ++level) {
    if (layout.levels[level].direct) continue;
    std::size_t base = level - 1;
    while (!layout.levels[base].direct) --base;
    const LevelSize& size = layout.description.levels[base];
    if (static_cast<double>(size.width) * size.height <= kMostAveraged) continue;
    return {ErrorCode::unsupported, fmt::format("{}: lacks overviews, so that a view from afar would have to fetch all of it; gdal_translate -of COG makes a "
                                                "file with them", layout.options.path)};
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_gdal(const GdalOptions& options, const geo::Ellipsoid& world) {
  Result<GDALDatasetUniquePtr> dataset = open_dataset(options.path);
  if (!dataset) return dataset.error();
  Result<GdalLayout> layout = inspect(*dataset.value(), options, world);
  if (!layout) return layout.error();
  return make_source(std::move(*layout));
}

Result<std::unique_ptr<RasterSource>> open_cog(const GdalOptions& options, const std::vector<std::string>& headers, const geo::Ellipsoid& world,
                                               std::shared_ptr<fetch::ByteStore> store) {
  constexpr std::chrono::milliseconds kPatience{30'000};
  auto file = fetch::RemoteFile::open(std::move(store), options.path, headers, RemoteChunks::kChunkBytes, kPatience);
  if (!file) return file.error();
  const auto chunks = std::make_shared<const RemoteChunks>(std::move(*file));
  Result<RemoteDataset> opened = open_remote_tiff(chunks);
  if (!opened) return opened.error();
  GdalOptions named = options;
  named.path = chunks->file().name();
  named.unpack_folder.clear();
  Result<GdalLayout> layout = inspect(*opened->dataset, named, world);
  if (!layout) return layout.error();
  layout->remote = chunks;
  layout->description.is_remote = true;
  layout->revision = fmt::format("{}|{}", chunks->file().revision(), layout->revision);
  if (opened->mount->failure()) return *opened->mount->failure();
  if (Result<void> suited = suit_for_network(*layout); !suited) return suited.error();
  return make_source(std::move(*layout));
}

}  // namespace tellurion::source
