#include "gpu/graveyard.h"

#include <epoxy/gl.h>

namespace tellurion::gpu {

void Graveyard::bury(ObjectKind kind, unsigned name) {
  std::lock_guard lock(mutex_);
  if (!closed_) names_.push_back({kind, name});
}

void Graveyard::empty() {
  {
    std::lock_guard lock(mutex_);
    names_.swap(doomed_);
  }
  for (const Name& dead : doomed_) {
    switch (dead.kind) {
      case ObjectKind::buffer: glDeleteBuffers(1, &dead.name); break;
      case ObjectKind::texture: glDeleteTextures(1, &dead.name); break;
      case ObjectKind::framebuffer: glDeleteFramebuffers(1, &dead.name); break;
      case ObjectKind::renderbuffer: glDeleteRenderbuffers(1, &dead.name); break;
      case ObjectKind::program: glDeleteProgram(dead.name); break;
      case ObjectKind::sampler: glDeleteSamplers(1, &dead.name); break;
      case ObjectKind::vertex_array: glDeleteVertexArrays(1, &dead.name); break;
    }
  }
  doomed_.clear();
}

void Graveyard::close() {
  std::lock_guard lock(mutex_);
  closed_ = true;
  names_.clear();
}

std::size_t Graveyard::size() const {
  std::lock_guard lock(mutex_);
  return names_.size();
}

}  // namespace tellurion::gpu
