// An OpenGL context without a window or display.
#pragma once

#include <memory>

#include "base/result.h"
#include "gpu/render_thread.h"

namespace tellurion::gpu {

/// A context of EGL's surfaceless platform; drawing goes to framebuffer objects.
class EglContext {
 public:
  /// Makes the context and makes it current on this thread. Errors: unavailable.
  static Result<std::unique_ptr<EglContext>> create(Api api);
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  ~EglContext();

 private:
  EglContext(void* display, void* context) : display_(display), context_(context) {}
  void* display_;
  void* context_;
};

}  // namespace tellurion::gpu
