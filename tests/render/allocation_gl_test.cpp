// Counts calls of operator new on the render thread: it is replaced for this whole test program.
#include <cstdlib>
#include <new>
#include <string>

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "gpu/object.h"
#include "render/renderer.h"
#include "render/test_planet.h"
#include "render/test_stage.h"

namespace {

thread_local std::size_t allocations = 0;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCounts = false;  // the sanitizer needs its own operator new
#else
constexpr bool kCounts = true;
#endif

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The other forms of new and delete call these.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif

using namespace tellurion;
using namespace tellurion::render;
using namespace tellurion::render::test;

TEST_CASE("draw: allocates nothing in steady state, whatever the look") {
  Stage stage(gpu::Api::core);
  auto tiles = upload_level(*stage.thread, *stage.renderer, geo::kWgs84, 1, flat, checker, 64);
  tiles[0].colour_before = tiles[1].key;
  tiles[0].fade = 0.5f;
  const gpu::Framebuffer framebuffer(*stage.thread);
  const gpu::Renderbuffer colour(*stage.thread);
  glBindRenderbuffer(GL_RENDERBUFFER, colour.name());
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, kWidth, kHeight);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour.name());

  FrameLook all;
  all.wireframe = all.bounds = all.tile_borders = all.antialiasing = true;
  for (const FrameLook& look : {FrameLook{}, bare_look(), all}) {
    FrameFigures figures;
    const auto frame = [&](int i) {
      const view::Camera camera = camera_at("30,20," + std::to_string(9000000 + i));
      const std::size_t before = allocations;
      figures = stage.renderer->draw(*stage.thread, camera, look, tiles, framebuffer.name());
      return allocations - before;
    };
    for (int i = 0; i < 3; ++i) frame(i);
    for (int i = 3; i < 8; ++i) CHECK(frame(i) == 0);
    CHECK(figures.draws >= static_cast<int>(tiles.size()));
    CHECK(figures.triangles == static_cast<std::int64_t>(tiles.size()) * kCells * kCells * 2);
  }
  const std::size_t before = allocations;
  CHECK(std::make_unique<int>(1) != nullptr);
  CHECK((allocations > before) == kCounts);
}
