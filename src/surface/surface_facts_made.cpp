#include "surface/surface_facts_made.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "surface/error_scan.h"
#include "surface/tile_grid.h"

namespace tellurion::surface {
namespace {

/// Spacings of equal data and tiles differ by rounding and by what the planet's shape does to them: no level for that.
constexpr double kClearlyFiner = 0.999;

/// Texels of the finest slots per sample of the imagery, along a side. A picture's pixels are interpolated between texels as these are
/// between samples: with one of them per sample contrast would be lost to both.
constexpr double kTexelsPerSample = 2.0;

class MadeFacts final : public SurfaceFacts {
 public:
  MadeFacts(std::shared_ptr<const SurfaceDescription> description, std::shared_ptr<const KnownErrors> errors)
      : description_(std::move(description)), errors_(std::move(errors)), table_(errors_ ? errors_->scanned : nullptr) {}

  TileFacts facts_of(const geo::TileKey& key) const override {
    const geo::Ellipsoid& ellipsoid = description_->ellipsoid;
    TileFacts facts;
    bool assumed = false;
    double finest_height = std::numeric_limits<double>::infinity();
    const Layer* uppermost = nullptr;
    int touching = 0;
    for (const Layer& layer : description_->heights) {
      if (!layer.enabled || !coverage_of(layer).touches(key)) continue;
      finest_height = std::min(finest_height, coverage_of(layer).spacing_under(key).value);
      assumed = assumed || !table_ || !is_scanned(layer);
      uppermost = &layer;
      ++touching;
    }
    const std::optional<ErrorTable::Found> prepared = find_prepared(uppermost, touching == 1, key);
    assumed = assumed && !prepared;
    if (prepared || table_) {
      const ErrorTable::Found found = prepared ? *prepared : table_->find(key);
      facts.min_height = found.record.min_height;
      facts.max_height = found.record.max_height;
      if (found.own) facts.height_error = found.record.error;
    }
    const double spacing = nominal_grid_spacing(ellipsoid, key.level);
    facts.assumed = assumed;
    if (assumed) {
      facts.min_height = std::min(facts.min_height, kAssumedMinHeight);
      facts.max_height = std::max(facts.max_height, kAssumedMaxHeight);
      if (spacing > kFinestGridOfTable * finest_height) {
        const auto error = static_cast<float>(kAssumedSlope * spacing * std::numbers::sqrt2 / 2.0);
        facts.height_error = larger(facts.height_error.value_or(HeightError{}), {error, error});
      }
    }
    if (!facts.height_error && finest_height == std::numeric_limits<double>::infinity()) facts.height_error = HeightError{};

    const double finest_colour = finest_spacing(description_->colours, key);
    const double shown_by_texel = kTexelsPerSample * nominal_colour_texel(ellipsoid, key.level);
    facts.own_colour = key.level == 0 || finest_colour < kClearlyFiner * 2.0 * shown_by_texel;
    const auto has_any_of = [&](std::initializer_list<ImageUse> uses) {
      return facts.own_colour && std::ranges::any_of(description_->colours, [&](const Layer& layer) {
               return layer.enabled && std::ranges::find(uses, layer.use) != uses.end() && coverage_of(layer).touches(key);
             });
    };
    facts.own_effects = has_any_of({ImageUse::night, ImageUse::water});
    facts.own_overlay = has_any_of({ImageUse::overlay});
    facts.own_normals = has_any_of({ImageUse::normal});
    facts.finer_colour_below = finest_colour < kClearlyFiner * shown_by_texel;
    facts.own_slopes = key.level == 0 || finest_height < kClearlyFiner * 2.0 * nominal_slope_texel(ellipsoid, key.level);
    return facts;
  }

 private:
  /// What the table of the uppermost raster alone says, where nothing else shows.
  std::optional<ErrorTable::Found> find_prepared(const Layer* uppermost, bool is_alone, const geo::TileKey& key) const {
    if (!errors_ || uppermost == nullptr || !uppermost->source) return std::nullopt;
    const auto of = std::ranges::find(errors_->prepared, uppermost->source, &KnownErrors::OfRaster::raster);
    if (of == errors_->prepared.end()) return std::nullopt;
    const ErrorTable::Found found = of->table.find(key);
    const bool hides_all = found.record.whole != 0 && !uppermost->adds;
    return is_alone || hides_all ? std::optional(found) : std::nullopt;
  }

  std::shared_ptr<const SurfaceDescription> description_;
  std::shared_ptr<const KnownErrors> errors_;
  std::shared_ptr<const ErrorTable> table_;
};

}  // namespace

std::shared_ptr<const SurfaceFacts> make_facts(std::shared_ptr<const SurfaceDescription> description,
                                               std::shared_ptr<const KnownErrors> errors) {
  return std::make_shared<MadeFacts>(std::move(description), std::move(errors));
}

}  // namespace tellurion::surface
