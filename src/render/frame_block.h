// What is the same for all that a frame draws: the uniform block `Frame` of shaders/frame.glsl.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include "render/renderer.h"
#include "view/camera.h"

namespace tellurion::render {

/// Layout std140, as the shaders declare it.
struct FrameBlock {
  glm::mat4 clip_from_relative;
  glm::vec4 sun;
  glm::vec4 air_sun;
  glm::vec4 air_eye;
  glm::vec4 air_scale;
  glm::vec4 air_scatter;
  glm::vec4 air_extinction;
  glm::vec4 sky_east;
  glm::vec4 sky_north;
  glm::vec4 sky_up;
  glm::vec4 clear_colour;
};

/// Everything nearer than this is cut away. Floating-point depth loses nothing by its being small.
inline constexpr double kNearM = 0.1;

/// `reversed`: depth is near / distance, from 1 at kNearM to 0 at infinity, for a clip space of [0, 1].
FrameBlock make_frame_block(const view::Camera& camera, const FrameLook& look, const RendererOptions& options, bool reversed);

}  // namespace tellurion::render
