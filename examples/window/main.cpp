// Embeds a globe in a window of one's own: turns round the default world until the window is closed.
#include <cstdio>
#include <cstdlib>

#include <GLFW/glfw3.h>

#include "globe/api.h"

using namespace tellurion;

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : -1;  // how many to draw; all: until the window is closed
  auto fail = [](const Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), 1; };
  if (!glfwInit()) return std::fprintf(stderr, "no display\n"), 1;
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 1);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  GLFWwindow* window = glfwCreateWindow(1280, 720, "A planet of one's own", nullptr, nullptr);
  if (!window) return std::fprintf(stderr, "no OpenGL 4.1\n"), 1;
  glfwMakeContextCurrent(window);
  {
    auto world = globe::resolve_world("");
    if (!world) return fail(world.error());
    auto planet = globe::Globe::open(*world, {});
    if (!planet) return fail(planet.error());
    auto gl = gpu::RenderThread::adopt_current();
    if (!gl) return fail(gl.error());
    auto view = globe::GlobeView::create(**planet, **gl, std::size_t{256} << 20);
    if (!view) return fail(view.error());

    view::Pose pose;
    for (int frame = 0; frame != frames && !glfwWindowShouldClose(window); ++frame) {
      int width = 0, height = 0;
      glfwGetFramebufferSize(window, &width, &height);
      pose.position = {to_radians(Degrees(20.0)), to_radians(Degrees(0.2 * frame)), EllipsoidalHeight(1.5e7)};
      (*view)->draw(view::make_camera((*planet)->ellipsoid(), pose, to_radians(Degrees(45.0)), width, height), {});
      glfwSwapBuffers(window);
      glfwPollEvents();
    }
  }  // the view's graphics objects end before their context
  glfwTerminate();
}
