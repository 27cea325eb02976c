#include "surface/feather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <glm/common.hpp>

namespace tellurion::surface {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// Squared distances along one line, from those across it, in place: the lower envelope of parabolas. `hull` and `starts` are room of
/// count and count + 1.
void spread(float* line, std::ptrdiff_t stride, int count, std::vector<int>& hull, std::vector<double>& starts, std::vector<float>& values) {
  for (int i = 0; i < count; ++i) values[static_cast<std::size_t>(i)] = line[i * stride];
  int last = -1;
  for (int i = 0; i < count; ++i) {
    const float value = values[static_cast<std::size_t>(i)];
    if (value == kFar) continue;
    double start = -std::numeric_limits<double>::infinity();
    while (last >= 0) {
      const int other = hull[static_cast<std::size_t>(last)];
      const double f = static_cast<double>(value) + static_cast<double>(i) * i, g = static_cast<double>(values[static_cast<std::size_t>(other)]) + static_cast<double>(other) * other;
      start = (f - g) / (2.0 * (i - other));
      if (start > starts[static_cast<std::size_t>(last)]) break;
      --last;
      start = -std::numeric_limits<double>::infinity();
    }
    ++last;
    hull[static_cast<std::size_t>(last)] = i;
    starts[static_cast<std::size_t>(last)] = start;
  }
  if (last < 0) return;
  int at = 0;
  for (int i = 0; i < count; ++i) {
    while (at < last && starts[static_cast<std::size_t>(at) + 1] < i) ++at;
    const int from = hull[static_cast<std::size_t>(at)];
    line[i * stride] = static_cast<float>(i - from) * static_cast<float>(i - from) + values[static_cast<std::size_t>(from)];
  }
}

}  // namespace

double Extent::inside(glm::dvec2 pixel) const {
  const glm::dvec2 in = glm::min(pixel - lower, upper - pixel);
  return std::isnan(in.x) || std::isnan(in.y) ? std::numeric_limits<double>::quiet_NaN() : std::min(in.x, in.y);
}

Extent extent_of(const source::RasterDescription& raster, source::RasterReader& reader) {
  const source::LevelSize& size = raster.levels.front();
  const auto is_pole = [&](double y) {
    const std::array<glm::dvec2, 2> pixels{glm::dvec2(0.25 * size.width, y), glm::dvec2(0.75 * size.width, y)};
    std::array<geo::LatLon, 2> places;
    reader.to_places(pixels, places);
    const double step = raster.spacing.value / raster.ellipsoid.b();
    return std::all_of(places.begin(), places.end(),
                       [&](const geo::LatLon& p) { return std::cos(p.latitude.value) < 0.5 * step; });
  };
  Extent extent{glm::dvec2(-INFINITY), glm::dvec2(INFINITY)};
  if (!raster.wraps) {
    extent.lower.x = 0.0;
    extent.upper.x = size.width;
  }
  if (!is_pole(0.0)) extent.lower.y = 0.0;
  if (!is_pole(size.height)) extent.upper.y = size.height;
  return extent;
}

double opacity_at(const Extent& extent, glm::dvec2 pixel, double feather) {
  const double inside = extent.inside(pixel);
  if (!(inside >= 0.0)) return 0.0;
  return feather > 0.0 ? std::min(inside / feather, 1.0) : 1.0;
}

double VoidDistances::opacity_at(glm::dvec2 pixel) const {
  if (pixels.empty()) return 1.0;
  const glm::dvec2 at = glm::clamp((pixel - place.first) * place.scale - 0.5, glm::dvec2(0.0), glm::dvec2(width - 1, height - 1));
  const glm::ivec2 corner = glm::min(glm::ivec2(at), glm::max(glm::ivec2(width - 2, height - 2), 0));
  const glm::dvec2 share = at - glm::dvec2(corner);
  // Capped, so that the infinite count.
  const auto from = [&](int i, int j) {
    const int x = std::min(corner.x + i, width - 1), y = std::min(corner.y + j, height - 1);
    return std::min(static_cast<double>(pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]), feather + 2.0);
  };
  const double distance = glm::mix(glm::mix(from(0, 0), from(1, 0), share.x), glm::mix(from(0, 1), from(1, 1), share.x), share.y);
  return std::clamp(distance / feather, 0.0, 1.0);
}

std::vector<float> distances_to(const std::vector<bool>& is_void, int width, int height) {
  std::vector<float> distances(is_void.size());
  for (std::size_t i = 0; i < is_void.size(); ++i) distances[i] = is_void[i] ? 0.0f : kFar;
  const auto longest = static_cast<std::size_t>(std::max(width, height));
  std::vector<int> hull(longest);
  std::vector<double> starts(longest);
  std::vector<float> values(longest);
  for (int x = 0; x < width; ++x) spread(&distances[static_cast<std::size_t>(x)], width, height, hull, starts, values);
  for (int y = 0; y < height; ++y) spread(&distances[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)], 1, width, hull, starts, values);
  for (float& distance : distances) distance = std::sqrt(distance);
  return distances;
}

Result<VoidDistances> find_voids(cache::CachedRaster& raster, int level, glm::dvec2 low, glm::dvec2 high, double feather) {
  constexpr double kLargestWindow = 2048.0;  // pixels on a side
  const source::RasterDescription& about = raster.description();
  const int last = static_cast<int>(about.levels.size()) - 1;
  glm::dvec2 scale, first, end;
  VoidDistances voids;
  for (;; ++level) {
    scale = source::level_scale(about, level);
    voids.feather = feather * std::sqrt(scale.x * scale.y);
    const double margin = std::ceil(voids.feather) + 1.0;
    first = glm::floor(low * scale) - margin;
    end = glm::ceil(high * scale) + margin;
    const source::LevelSize& size = about.levels[static_cast<std::size_t>(level)];
    if (!about.wraps) {
      first.x = std::clamp(first.x, 0.0, size.width - 1.0);
      end.x = std::clamp(end.x, first.x + 1.0, static_cast<double>(size.width));
    }
    first.y = std::clamp(first.y, 0.0, size.height - 1.0);
    end.y = std::clamp(end.y, first.y + 1.0, static_cast<double>(size.height));
    if (level == last || (voids.feather <= kFinestFeather && std::max(end.x - first.x, end.y - first.y) <= kLargestWindow)) break;
  }
  if (voids.feather <= 0.5) return VoidDistances{};  // less than what interpolation makes of an edge
  const source::PixelWindow window{static_cast<int>(first.x), static_cast<int>(first.y), static_cast<int>(end.x - first.x), static_cast<int>(end.y - first.y)};
  const Result<raster::Image> image = raster.read_colours(level, window);
  if (!image) return image.error();
  voids.place = {first / scale, scale};
  voids.width = window.width;
  voids.height = window.height;
  std::vector<bool> is_void(image->rgba.size() / 4);
  bool any = false;
  for (std::size_t i = 0; i < is_void.size(); ++i) {
    is_void[i] = image->rgba[4 * i + 3] == 0;
    any = any || is_void[i];
  }
  if (!any) return VoidDistances{};
  voids.pixels = distances_to(is_void, window.width, window.height);
  for (float& distance : voids.pixels) distance -= 0.5f;
  return voids;
}

void fade_from_voids(raster::Image& image, const ImagePlace& place, const VoidDistances& voids, const Extent& extent, double feather) {
  if (voids.pixels.empty()) return;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      std::uint8_t* const pixel = &image.rgba[image.offset(x, y)];
      if (pixel[3] == 0) continue;
      const glm::dvec2 at = place.first + (glm::dvec2(x, y) + 0.5) / place.scale;
      const double border = opacity_at(extent, at, feather), from_voids = voids.opacity_at(at);
      if (!(from_voids < border)) continue;
      for (int c = 0; c < 4; ++c) pixel[c] = static_cast<std::uint8_t>(std::lround(pixel[c] * from_voids / border));
    }
  }
}

}  // namespace tellurion::surface
