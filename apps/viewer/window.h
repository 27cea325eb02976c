// A window of the desktop with an OpenGL context, current on the thread that opened it.
#pragma once

#include <glm/vec2.hpp>
#include <memory>
#include <string>

#include "globe/api.h"

struct GLFWwindow;

namespace tellurion::apps {

class Window {
 public:
  /// A window that is hidden until show(). Asks for OpenGL 4.1 core, and for OpenGL ES 3.0 where that fails; with `api`
  /// es only for the latter. Errors: unavailable (no display, no driver), naming the way to work without.
  static Result<Window> open(const std::string& title, glm::ivec2 size, gpu::Api api);

  GLFWwindow* handle() const { return handle_.get(); }
  gpu::Api api() const { return api_; }

  void show();
  bool should_close() const;
  void close();
  /// Size in pixels; zero while the window is minimised.
  glm::ivec2 size_px() const;
  /// Pixels of the picture for one unit of the desktop's cursor positions.
  glm::dvec2 scale() const;
  void show_frame();
  /// Has the thread that waits for events go on. On any thread.
  static void wake();

 private:
  struct Closer {
    void operator()(GLFWwindow* window) const;
  };
  Window(GLFWwindow* handle, gpu::Api api) : handle_(handle), api_(api) {}

  std::unique_ptr<GLFWwindow, Closer> handle_;
  gpu::Api api_;
};

}  // namespace tellurion::apps
