// From the nearness of each pixel to places on the ground, in double precision.
#pragma once

#include <cstdint>
#include <span>

#include "geo/ellipsoid.h"
#include "render/renderer.h"
#include "view/camera.h"

namespace tellurion::render {

/// `nearness` holds, bottom row first, the bits of the float 1 / (distance along the view's axis) at each pixel's centre,
/// in the first of every `stride` words; 0 where there is sky.
GeoPicture locate_pixels(const geo::Ellipsoid& ellipsoid, const view::Camera& camera,
                         std::span<const std::uint32_t> nearness, std::size_t stride);

}  // namespace tellurion::render
