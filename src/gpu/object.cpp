#include "gpu/object.h"

#include <epoxy/gl.h>

namespace tellurion::gpu {

unsigned create_name(const RenderThread& thread, ObjectKind kind) {
  thread.check();
  unsigned name = 0;
  switch (kind) {
    case ObjectKind::buffer: glGenBuffers(1, &name); break;
    case ObjectKind::texture: glGenTextures(1, &name); break;
    case ObjectKind::framebuffer: glGenFramebuffers(1, &name); break;
    case ObjectKind::renderbuffer: glGenRenderbuffers(1, &name); break;
    case ObjectKind::program: name = glCreateProgram(); break;
    case ObjectKind::sampler: glGenSamplers(1, &name); break;
    case ObjectKind::vertex_array: glGenVertexArrays(1, &name); break;
  }
  return name;
}

}  // namespace tellurion::gpu
