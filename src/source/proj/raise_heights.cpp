#include "source/proj/raise_heights.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "source/proj/undulation_field.h"

namespace tellurion::source {

void raise_to_ellipsoid(raster::HeightGrid& grid, const RasterDescription& about, int level, const PixelWindow& window, PixelMapping& mapping,
                        VerticalDatum& datum) {
  const glm::dvec2 scale = level_scale(about, level);
  const Metres spacing = about.spacing / std::min(scale.x, scale.y);
  const UndulationsAt at = [&](std::span<const glm::ivec2> samples, std::span<double> metres) {
    std::vector<glm::dvec2> pixels;
    pixels.reserve(samples.size());
    for (const glm::ivec2& sample : samples) pixels.push_back(glm::dvec2(window.x + sample.x + 0.5, window.y + sample.y + 0.5) / scale);
    std::vector<geo::LatLon> places(pixels.size());
    mapping.to_places(pixels, places);
    datum.undulations(places, metres);
  };
  const std::vector<float> undulations = undulation_field({window.width, window.height}, spacing, at);
  const auto slope = static_cast<float>(datum.slope());
  for (std::size_t i = 0; i < undulations.size(); ++i) grid.metres[i] = grid.metres[i] * slope + undulations[i];
}

}  // namespace tellurion::source
