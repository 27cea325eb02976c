#include "render/sky_pass.h"

#include <cstdint>
#include <vector>

#include <epoxy/gl.h>

#include "render/pass_source.h"

namespace tellurion::render {
namespace {

// As in shaders/sky.vert.
constexpr int kSectors = 192;
constexpr int kRings = 24;
constexpr int kIndices = kSectors * kRings * 6;

std::vector<std::uint16_t> ring_triangles() {
  std::vector<std::uint16_t> indices;
  indices.reserve(kIndices);
  for (int ring = 0; ring < kRings; ++ring) {
    for (int sector = 0; sector < kSectors; ++sector) {
      const int a = ring * (kSectors + 1) + sector;
      const int b = a + kSectors + 1;
      for (const int vertex : {a, a + 1, b, b, a + 1, b + 1}) indices.push_back(static_cast<std::uint16_t>(vertex));
    }
  }
  return indices;
}

}  // namespace

Result<SkyPass> SkyPass::create(gpu::RenderThread& thread) {
  gpu::ProgramFamily programs({shader_texts({"frame.glsl", "atmosphere.glsl", "sky.vert"}),
                               shader_texts({"sky.frag"}),
                               {},
                               {},
                               {},
                               {"Frame"}});
  const auto program = programs.variant(thread, 0);
  if (!program) return program.error();
  return SkyPass(thread, std::move(programs));
}

SkyPass::SkyPass(gpu::RenderThread& thread, gpu::ProgramFamily programs)
    : programs_(std::move(programs)), array_(thread), indices_(thread) {
  const auto indices = ring_triangles();
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof indices[0]), indices.data(),
               GL_STATIC_DRAW);
  glBindVertexArray(0);
}

void SkyPass::draw(gpu::RenderThread& thread) {
  const auto program = programs_.variant(thread, 0);
  if (!program) return;
  glUseProgram((*program)->program.name());
  glBindVertexArray(array_.name());
  glDrawElements(GL_TRIANGLES, kIndices, GL_UNSIGNED_SHORT, nullptr);
  glBindVertexArray(0);
}

}  // namespace tellurion::render
