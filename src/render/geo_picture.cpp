#include "render/geo_picture.h"

#include <bit>
#include <limits>

#include <glm/geometric.hpp>

namespace tellurion::render {

GeoPicture locate_pixels(const geo::Ellipsoid& ellipsoid, const view::Camera& camera,
                         std::span<const std::uint32_t> nearness, std::size_t stride) {
  const auto width = static_cast<std::size_t>(camera.width);
  const auto height = static_cast<std::size_t>(camera.height);
  const std::size_t count = width * height;
  constexpr double kSky = std::numeric_limits<double>::quiet_NaN();
  GeoPicture out{camera.width, camera.height, std::vector<double>(count, kSky), std::vector<double>(count, kSky),
                 std::vector<double>(count, kSky), std::vector<double>(count, kSky)};
  const glm::dvec3 forward = camera.forward().xyz;
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const float near = std::bit_cast<float>(nearness[((height - 1 - y) * width + x) * stride]);
      if (!(near > 0.0f)) continue;
      const geo::Vector<geo::Ecef> ray = camera.ray({static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5});
      const double distance = 1.0 / (static_cast<double>(near) * glm::dot(ray.xyz, forward));
      const geo::Geodetic place = geo::to_geodetic(ellipsoid, camera.eye + ray * distance);
      const std::size_t i = y * width + x;
      out.latitude[i] = to_degrees(place.latitude).value;
      out.longitude[i] = to_degrees(place.longitude).value;
      out.elevation[i] = place.height.value;
      out.distance[i] = distance;
    }
  }
  return out;
}

}  // namespace tellurion::render
