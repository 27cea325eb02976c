#include "render/target.h"

#include <epoxy/gl.h>

namespace tellurion::render {
namespace {

constexpr std::size_t kColourBytes = 4;  // of every format in use
constexpr std::size_t kDepthBytes = 4;

}  // namespace

std::size_t Target::bytes() const {
  return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * static_cast<std::size_t>(samples_) *
         (kColourBytes + kDepthBytes);
}

void Target::resize(const gpu::RenderThread& thread, int width, int height, Budget& budget) {
  if (width == width_ && height == height_) return;
  release(budget);
  width_ = width;
  height_ = height;
  colour_ = gpu::Renderbuffer(thread);
  depth_ = gpu::Renderbuffer(thread);
  framebuffer_ = gpu::Framebuffer(thread);
  const int samples = samples_ > 1 ? samples_ : 0;
  glBindRenderbuffer(GL_RENDERBUFFER, colour_.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, colour_format_, width, height);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT32F, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.name());
  budget.used += bytes();
}

void Target::release(Budget& budget) {
  budget.used -= bytes();
  width_ = height_ = 0;
  framebuffer_ = {};
  colour_ = {};
  depth_ = {};
}

}  // namespace tellurion::render
