#include "source/proj/pixel_mapping.h"

#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

namespace tellurion::source {
namespace {

constexpr double kWrapTolerancePixels = 0.1;  ///< geotransforms are written with few digits

glm::dvec2 transformed(const GeoTransform& t, glm::dvec2 p) { return {t[0] + p.x * t[1] + p.y * t[2], t[3] + p.x * t[4] + p.y * t[5]}; }

std::optional<GeoTransform> inverted(const GeoTransform& t) {
  const double det = t[1] * t[5] - t[2] * t[4];
  const double size = std::abs(t[1] * t[5]) + std::abs(t[2] * t[4]);
  if (!std::isfinite(det) || !(std::abs(det) > size * 1e-12)) return std::nullopt;
  const double a = t[5] / det;
  const double b = -t[2] / det;
  const double c = -t[4] / det;
  const double d = t[1] / det;
  return GeoTransform{-(a * t[0] + b * t[3]), a, b, -(c * t[0] + d * t[3]), c, d};
}

}  // namespace

Result<PixelMapping> PixelMapping::create(const Georeference& georeference, const geo::Ellipsoid& world) {
  const std::optional<GeoTransform> inverse = inverted(georeference.transform);
  if (!inverse) return Error{ErrorCode::unsupported, "its geotransform squeezes pixels to nothing: set it with gdal_translate -a_ullr"};
  const glm::dvec2 centre = transformed(georeference.transform, {georeference.width * 0.5, georeference.height * 0.5});
  Result<Projection> projection = Projection::create(georeference.crs, world, centre);
  if (!projection) return projection.error();
  PixelMapping mapping(std::move(projection).value(), georeference);
  mapping.inverse_ = *inverse;
  return mapping;
}

PixelMapping::PixelMapping(Projection projection, const Georeference& georeference)
    : projection_(std::move(projection)), forward_(georeference.transform), width_(georeference.width) {
  const GeoTransform& t = forward_;
  const std::optional<double> period = projection_.period();
  if (!period || t[2] != 0.0 || t[4] != 0.0) return;
  period_ = std::abs(*period / t[1]);
  wraps_ = std::abs(period_ - width_) < kWrapTolerancePixels;
}

void PixelMapping::to_pixels(std::span<const geo::LatLon> places, std::span<glm::dvec2> pixels) {
  projection_.to_coordinates(places, pixels);
  for (glm::dvec2& pixel : pixels) {
    pixel = transformed(inverse_, pixel);
    if (wraps_) {
      const double turns = pixel.x / period_;
      pixel.x = (turns - std::floor(turns)) * width_;
      if (pixel.x >= width_) pixel.x = 0.0;  // a tiny negative turn, rounded up
    } else if (period_ > 0.0) {
      pixel.x -= period_ * std::round((pixel.x - 0.5 * width_) / period_);
    }
  }
}

void PixelMapping::to_places(std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) {
  assert(pixels.size() == places.size());
  coordinates_.clear();
  const double stretch = wraps_ ? period_ / width_ : 1.0;  // so that `width` columns are the whole circle, exactly
  for (const glm::dvec2& pixel : pixels) coordinates_.push_back(transformed(forward_, {pixel.x * stretch, pixel.y}));
  projection_.to_places(coordinates_, places);
}

geo::LatLon PixelMapping::to_place(glm::dvec2 pixel) {
  geo::LatLon place;
  to_places({&pixel, 1}, {&place, 1});
  return place;
}

}  // namespace tellurion::source
