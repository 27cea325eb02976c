// Renders one picture of the default world without a window, and asks it for a height.
#include <cstdio>

#include "globe/api.h"

using namespace tellurion;

int main(int argc, char** argv) {
  const char* file = argc > 1 ? argv[1] : "planet.png";
  auto fail = [](const Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), 1; };

  auto world = globe::resolve_world("");  // or a world file, or any raster
  if (!world) return fail(world.error());
  auto planet = globe::Globe::open(*world, {});
  if (!planet) return fail(planet.error());
  auto gl = gpu::RenderThread::headless(gpu::Api::core);
  if (!gl) return fail(gl.error());
  auto view = globe::GlobeView::create(**planet, **gl, std::size_t{256} << 20);
  if (!view) return fail(view.error());

  // 3,000 km above the Alps, looking straight down.
  view::Pose pose;
  pose.position = {to_radians(Degrees(46.5)), to_radians(Degrees(9.0)), EllipsoidalHeight(3e6)};
  const auto camera = view::make_camera((*planet)->ellipsoid(), pose, to_radians(Degrees(45.0)), 1280, 720);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  (*view)->finish(camera, {}, deadline);
  if (auto written = globe::write_png(file, (*view)->picture(camera, {})); !written) return fail(written.error());

  auto heights = (*planet)->height_sampler();
  if (!heights) return fail(heights.error());
  const auto height = heights->height_at(geo::place_of(pose.position));
  if (!height) return fail(height.error());
  std::printf("%s: the ground there is %.0f m high\n", file, height->height.value);
}
