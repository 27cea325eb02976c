// What a view's settings mean for the cut and for the renderer.
#pragma once

#include <cstddef>

#include "globe/globe_view.h"

namespace tellurion::globe {

render::FrameLook look_of(const ViewSettings& settings, const World& world, const view::Camera& camera);

/// `max_bytes`: of graphics memory, for what a picture shows.
surface::SelectionSettings selection_of(const ViewSettings& settings, std::size_t max_bytes);

}  // namespace tellurion::globe
