#include "viewer/window.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>

namespace tellurion::apps {
namespace {

/// What GLFW has complained about last.
std::string glfw_complaint() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text ? text : "no reason given";
}

GLFWwindow* create(const std::string& title, glm::ivec2 size, gpu::Api api) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  if (api == gpu::Api::core) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 1);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  } else {
    glfwWindowHint(GLFW_CLIENT_API, GLFW_OPENGL_ES_API);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
  }
  return glfwCreateWindow(size.x, size.y, title.c_str(), nullptr, nullptr);
}

}  // namespace

void Window::Closer::operator()(GLFWwindow* window) const {
  glfwDestroyWindow(window);
  glfwTerminate();
}

Result<Window> Window::open(const std::string& title, glm::ivec2 size, gpu::Api api) {
  const auto fail = [](const std::string& why) {
    return Error{
        ErrorCode::unavailable,
        fmt::format("no window can be opened ({}): use tellurion render for a picture without a display", why)};
  };
  if (!glfwInit()) return fail(glfw_complaint());
  GLFWwindow* handle = create(title, size, api);
  std::string why = handle ? "" : glfw_complaint();
  if (!handle && api == gpu::Api::core) {
    api = gpu::Api::es;
    handle = create(title, size, api);
    if (!handle) why += "; " + glfw_complaint();
  }
  if (!handle) {
    glfwTerminate();
    return fail(why);
  }
  Window window(handle, api);
  glfwMakeContextCurrent(handle);
  glfwSwapInterval(1);
  return window;
}

void Window::show() { glfwShowWindow(handle()); }

bool Window::should_close() const { return glfwWindowShouldClose(handle()) != 0; }

void Window::close() { glfwSetWindowShouldClose(handle(), GLFW_TRUE); }

glm::ivec2 Window::size_px() const {
  glm::ivec2 size(0);
  glfwGetFramebufferSize(handle(), &size.x, &size.y);
  return size;
}

glm::dvec2 Window::scale() const {
  glm::ivec2 units(0);
  glfwGetWindowSize(handle(), &units.x, &units.y);
  return glm::dvec2(size_px()) / glm::dvec2(glm::max(units, glm::ivec2(1)));
}

void Window::wake() { glfwPostEmptyEvent(); }

void Window::show_frame() { glfwSwapBuffers(handle()); }

}  // namespace tellurion::apps
