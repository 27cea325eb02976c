// Shader programs made of the embedded files of shaders/.
#pragma once

#include <string_view>
#include <vector>

#include "gpu/program.h"
#include "render/embedded_shaders.h"

namespace tellurion::render {

/// The texts of the named files, in order.
inline std::vector<gpu::ShaderText> shader_texts(std::vector<std::string_view> names) {
  std::vector<gpu::ShaderText> texts;
  for (const std::string_view name : names) texts.push_back({name, embedded_shader(name)});
  return texts;
}

}  // namespace tellurion::render
