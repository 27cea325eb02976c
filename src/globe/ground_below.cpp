#include "globe/ground_below.h"

#include <algorithm>
#include <atomic>

#include "globe/surface_worker.h"
#include "surface/global_heights.h"

namespace tellurion::globe {

/// Written by a worker, read by the render thread.
struct GroundBelow::Answer {
  std::atomic<bool> known{false};
  std::atomic<bool> asked{false};
  std::atomic<double> metres{0.0};
  source::Awaited awaited;  ///< what the next answer waits for; the worker's while `asked`
};

GroundBelow::GroundBelow() : answer_(std::make_shared<Answer>()) {}

std::optional<EllipsoidalHeight> GroundBelow::find(Globe& globe, const view::Camera& camera) {
  const auto answer = answer_;
  if (!answer->asked.exchange(true)) {
    const geo::Geodetic eye = geo::to_geodetic(globe.ellipsoid(), camera.eye);
    // From far above the coarse data will do: the finest may have to be fetched.
    constexpr double kShareOfHeight = 0.01;
    const double spacing = std::max(eye.height.value, 0.0) * kShareOfHeight;
    const bool submitted = globe.try_submit([answer, place = geo::place_of(eye), spacing, surface = globe.surface()](SurfaceWorker& worker) {
      if (const auto model = worker.elevation(surface)) {
        const auto height = (*model)->height_at(place, surface::Lookup::bilinear, spacing);
        answer->awaited.clear();
        const bool pending = (*model)->take_pending(answer->awaited);
        if (height && !pending) {
          answer->metres = height->metres;
          answer->known = true;
        }
      }
      answer->asked = false;
    });
    if (!submitted) answer->asked = false;
  }
  if (!answer->known) {
    const auto global = globe.resident_heights();
    if (!global) return std::nullopt;
    return EllipsoidalHeight(global->at(geo::place_of(geo::to_geodetic(globe.ellipsoid(), camera.eye))));
  }
  return EllipsoidalHeight(answer->metres);
}

}  // namespace tellurion::globe
