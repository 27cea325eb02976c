// A colour and a depth buffer to draw into.
#pragma once

#include <cstddef>

#include "gpu/object.h"
#include "render/budget.h"

namespace tellurion::render {

class Target {
 public:
  /// `colour_format` is an OpenGL name. Depth is a 32-bit float. `samples` 1: not multisampled.
  explicit Target(unsigned colour_format, int samples = 1) : colour_format_(colour_format), samples_(samples) {}

  /// Makes it this large, if it is not.
  void resize(const gpu::RenderThread& thread, int width, int height, Budget& budget);
  void release(Budget& budget);

  unsigned framebuffer() const { return framebuffer_.name(); }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  std::size_t bytes() const;

  unsigned colour_format_;
  int samples_;
  int width_ = 0;
  int height_ = 0;
  gpu::Renderbuffer colour_;
  gpu::Renderbuffer depth_;
  gpu::Framebuffer framebuffer_;
};

}  // namespace tellurion::render
