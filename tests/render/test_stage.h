// A context, a renderer in it, and cameras, for tests.
#pragma once

#include <memory>
#include <span>
#include <string>

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "render/renderer.h"

namespace tellurion::render::test {

inline constexpr int kWidth = 320;
inline constexpr int kHeight = 180;

/// A context and a renderer in it.
struct Stage {
  explicit Stage(gpu::Api api, const std::string& without = "", RendererOptions options = {.ellipsoid = geo::kWgs84}) {
    auto made = gpu::RenderThread::headless(api);
    REQUIRE(made.has_value());
    thread = std::move(*made);
    if (!without.empty()) thread->disable_capability(without);
    auto created = Renderer::create(*thread, options);
    REQUIRE_MESSAGE(created.has_value(), (created ? std::string() : created.error().message));
    renderer = std::move(*created);
  }
  ~Stage() {
    CHECK(glGetError() == GL_NO_ERROR);
    for (const std::string& error : thread->driver_errors()) FAIL_CHECK(error);
  }

  raster::Image picture(const view::Camera& camera, const FrameLook& look, std::span<const surface::DrawTile> tiles) {
    return renderer->picture(*thread, camera, look, tiles);
  }
  GeoPicture measure(const view::Camera& camera, const FrameLook& look, std::span<const surface::DrawTile> tiles) {
    return renderer->measure(*thread, camera, look, tiles);
  }

  std::unique_ptr<gpu::RenderThread> thread;
  std::unique_ptr<Renderer> renderer;
};

inline view::Camera camera_at(const std::string& pose, int width = kWidth, int height = kHeight) {
  const auto parsed = view::parse_pose(pose);
  REQUIRE(parsed.has_value());
  return view::make_camera(geo::kWgs84, *parsed, to_radians(Degrees(45.0)), width, height);
}

inline FrameLook bare_look() {
  FrameLook look;
  look.lighting = look.atmosphere = false;
  return look;
}

}  // namespace tellurion::render::test
