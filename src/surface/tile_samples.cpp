#include "surface/tile_samples.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include <glm/common.hpp>

#include "surface/tile_grid.h"

namespace tellurion::surface {

source::PixelWindow window_under(source::RasterReader& reader, const source::RasterDescription& about, const geo::TileKey& key) {
  constexpr int kSide = 17;
  const source::LevelSize size = about.levels.front();
  const std::vector<geo::Vector<geo::Ecef>> normals = grid_normals({key, kSide});
  std::vector<geo::LatLon> places(normals.size());
  std::vector<glm::dvec2> pixels(normals.size());
  std::transform(normals.begin(), normals.end(), places.begin(), geo::place_of_normal);
  reader.to_pixels(places, pixels);

  const source::PixelWindow everything{0, 0, size.width, size.height};
  glm::dvec2 low(INFINITY), high(-INFINITY);
  bool all_columns = false;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    glm::dvec2& pixel = pixels[i];
    if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) return everything;
    if (about.wraps && i > 0) {
      // Round a pole, steps are long; elsewhere they are a small part of the way round.
      const double before = pixels[i % kSide > 0 ? i - 1 : i - kSide].x;
      pixel.x -= size.width * std::round((pixel.x - before) / size.width);
      all_columns = all_columns || std::abs(pixel.x - before) > size.width / 8.0;
    }
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  const glm::dvec2 spare = (high - low) / 16.0 + 3.0;
  low = glm::floor(low - spare);
  high = glm::ceil(high + spare);
  const auto clamped = [](double value, int most) { return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most))); };
  source::PixelWindow window;
  window.y = clamped(low.y, size.height);
  window.height = clamped(high.y, size.height) - window.y;
  if (!about.wraps) {
    window.x = clamped(low.x, size.width);
    window.width = clamped(high.x, size.width) - window.x;
  } else if (all_columns || high.x - low.x >= size.width) {
    window.width = size.width;
  } else {
    window.x = static_cast<int>(low.x - size.width * std::floor(low.x / size.width));
    window.width = static_cast<int>(high.x - low.x);
  }
  return window;
}

double sample_place(int i, int size) { return i < 0 ? i + 1 : i >= size ? i : i + 0.5; }

void include_border(source::PixelWindow& window, const source::RasterDescription& about) {
  const source::LevelSize& size = about.levels.front();
  const auto include = [](int& first, int& count, int length) {
    const int end = first + count == length ? length + 2 : first + count;
    if (first == 0) first = -2;
    count = end - first;
  };
  include(window.y, window.height, size.height);
  if (!about.wraps) include(window.x, window.width, size.width);
}

std::vector<TileSample> samples_under(source::RasterReader& reader, const source::RasterDescription& about, const geo::TileKey& key) {
  source::PixelWindow window = window_under(reader, about, key);
  if (window.width <= 0 || window.height <= 0) return {};
  include_border(window, about);
  const source::LevelSize size = about.levels.front();
  const geo::FaceRect rect = geo::face_rect(key);
  std::vector<TileSample> samples;
  std::vector<glm::dvec2> row(static_cast<std::size_t>(window.width));
  std::vector<geo::LatLon> places(row.size());
  for (int y = window.y; y < window.y + window.height; ++y) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const int x = window.x + static_cast<int>(i);
      row[i] = {about.wraps ? x % size.width + 0.5 : sample_place(x, size.width), sample_place(y, size.height)};
    }
    reader.to_places(row, places);
    for (const geo::LatLon& place : places) {
      if (!std::isfinite(place.latitude.value) || !std::isfinite(place.longitude.value)) continue;
      const std::optional<glm::dvec2> uv = geo::project_to_face(key.face, geo::normal_at(place));
      if (!uv) continue;
      const glm::dvec2 st = (*uv - rect.lower) / (rect.upper - rect.lower);
      if (st.x >= 0.0 && st.x <= 1.0 && st.y >= 0.0 && st.y <= 1.0) samples.push_back({place, st});
    }
  }
  return samples;
}

}  // namespace tellurion::surface
