// Draws the atmosphere where nothing else is.
#pragma once

#include "base/result.h"
#include "gpu/program.h"

namespace tellurion::render {

class SkyPass {
 public:
  static Result<SkyPass> create(gpu::RenderThread& thread);

  /// The frame's block must be bound; depth must let through what lies at infinity.
  void draw(gpu::RenderThread& thread);

 private:
  SkyPass(gpu::RenderThread& thread, gpu::ProgramFamily programs);

  gpu::ProgramFamily programs_;
  gpu::VertexArray array_;
  gpu::Buffer indices_;
};

}  // namespace tellurion::render
