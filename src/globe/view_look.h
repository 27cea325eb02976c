// What a view's settings mean for the cut and for the renderer.
#pragma once

#include <cstddef>
#include <optional>

#include "globe/globe_view.h"

namespace tellurion::globe {

/// Direction to the light for a camera: the sun at `time`, or without a time the map-maker's light: from the north-west,
/// 45 degrees high, at the place under the eye.
geo::Vector<geo::Ecef> light_direction(const World& world, const view::Camera& camera, const std::optional<UtcTime>& time);

render::FrameLook look_of(const ViewSettings& settings, const World& world, const view::Camera& camera);

/// `max_bytes`: of graphics memory, for what a picture shows.
surface::SelectionSettings selection_of(const ViewSettings& settings, std::size_t max_bytes);

}  // namespace tellurion::globe
