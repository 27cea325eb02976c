#include "surface/whole_cover.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "surface/tile_grid.h"
#include "surface/tile_samples.h"

namespace tellurion::surface {
namespace {

bool lies_within(cache::CachedRaster& raster, const geo::TileKey& key) {
  const source::RasterDescription& about = raster.description();
  const double width = about.levels.front().width, height = about.levels.front().height;
  std::vector<geo::LatLon> places;
  for (const auto& normal : grid_normals({key, kGridSide})) places.push_back(geo::place_of_normal(normal));
  std::vector<glm::dvec2> pixels(places.size());
  raster.reader().to_pixels(places, pixels);
  return std::ranges::all_of(pixels, [&](const glm::dvec2& p) { return (about.wraps || (p.x >= 0.0 && p.x <= width)) && p.y >= 0.0 && p.y <= height; });
}

Result<bool> has_no_void(cache::CachedRaster& raster, const source::PixelWindow& window) {
  const int columns = raster.description().levels.front().width;
  std::vector<glm::dvec2> pixels(static_cast<std::size_t>(window.width));
  std::vector<cache::HeightSample> heights(pixels.size());
  for (int row = 0; row < window.height; ++row) {
    for (int x = 0; x < window.width; ++x) pixels[static_cast<std::size_t>(x)] = {(window.x + x) % columns + 0.5, window.y + row + 0.5};
    if (Result<void> read = raster.sample_heights(0, pixels, heights); !read) return read.error();
    if (std::ranges::any_of(heights, [](const cache::HeightSample& sample) { return sample.coverage < 1.0; })) return false;
  }
  return true;
}

}  // namespace

Result<bool> is_covered_by_one(ElevationModel& model, const geo::TileKey& key) {
  const std::vector<Layer>& layers = model.description().heights;
  if (layers.size() != 1 || layers.front().catalogue || layers.front().adds || layers.front().feather > 0.0) return false;
  bool whole = false;
  const Result<void> looked = model.for_each_under(key, [&](cache::CachedRaster& raster, Metres) -> Result<void> {
    const source::PixelWindow window = window_under(raster.reader(), raster.description(), key);
    if (window.width <= 0 || window.height <= 0 || !lies_within(raster, key)) return {};
    const Result<bool> found = has_no_void(raster, window);
    if (!found) return found.error();
    whole = *found;
    return {};
  });
  if (!looked) return looked.error();
  return whole;
}

}  // namespace tellurion::surface
