#include <string>
#include <thread>
#include <utility>

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "gpu/object.h"
#include "gpu/render_thread.h"

using namespace tellurion;
using namespace tellurion::gpu;

namespace {

std::unique_ptr<RenderThread> context(Api api) {
  auto thread = RenderThread::headless(api);
  REQUIRE_MESSAGE(thread.has_value(), (thread ? std::string() : thread.error().message));
  return std::move(*thread);
}

/// A texture that the driver knows: a name becomes an object when it is first bound.
Texture made_texture(const RenderThread& thread) {
  Texture texture(thread);
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glBindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

}  // namespace

TEST_CASE("headless: gives the interface asked for") {
  for (const Api api : {Api::core, Api::es}) {
    const auto thread = context(api);
    CHECK(thread->capabilities().is_es == (api == Api::es));
    CHECK_FALSE(thread->capabilities().renderer.empty());
    CHECK_FALSE(thread->capabilities().version.empty());
    CHECK(thread->capabilities().max_samples >= 4);  // guaranteed by OpenGL ES 3.0, table 6.31
    CHECK(glGetError() == GL_NO_ERROR);
  }
}

TEST_CASE("adopt_current: says so when no context is current") {
  const auto thread = RenderThread::adopt_current();
  REQUIRE_FALSE(thread.has_value());
  CHECK(thread.error().code == ErrorCode::unavailable);
}

TEST_CASE("adopt_current: works in a context made by someone else and leaves it usable") {
  const auto owner = context(Api::core);
  {
    const auto guest = RenderThread::adopt_current();
    REQUIRE(guest.has_value());
    const Texture texture = made_texture(**guest);
    CHECK(glIsTexture(texture.name()));
  }
  CHECK(glGetString(GL_VERSION) != nullptr);
}

TEST_CASE("disable_capability: hides what the driver has") {
  const auto thread = context(Api::core);
  thread->disable_capability("clip_control");
  thread->disable_capability("anisotropic_filter");
  CHECK_FALSE(thread->capabilities().clip_control);
  CHECK_FALSE(thread->capabilities().anisotropic_filter);
  CHECK(thread->capabilities().max_anisotropy == 1.0f);
}

TEST_CASE("Object: moving keeps one owner") {
  const auto thread = context(Api::core);
  Texture a = made_texture(*thread);
  const unsigned name = a.name();
  Texture b = std::move(a);
  CHECK_FALSE(a);  // NOLINT(bugprone-use-after-move): what is left is the point
  CHECK(b.name() == name);
  b = Texture();
  thread->empty_graveyard();
  CHECK_FALSE(glIsTexture(name));
}

TEST_CASE("empty_graveyard: deletes what other threads dropped, and not before") {
  const auto thread = context(Api::core);
  Texture texture = made_texture(*thread);
  const unsigned name = texture.name();
  std::thread([dropped = std::move(texture)] {}).join();
  CHECK(glIsTexture(name));
  thread->empty_graveyard();
  CHECK_FALSE(glIsTexture(name));
  CHECK(glGetError() == GL_NO_ERROR);
}

TEST_CASE("Object: outlives its context harmlessly") {
  auto thread = context(Api::core);
  Buffer orphan(*thread);
  const auto graveyard = thread->graveyard();
  thread.reset();
  orphan = Buffer();
  CHECK(graveyard->size() == 0);
}

#ifndef NDEBUG
TEST_CASE("driver_errors: names each kind of mistake once") {
  const auto thread = context(Api::core);
  for (int i = 0; i < 3; ++i) glEnable(GL_TEXTURE_2D_ARRAY);  // no such switch
  CHECK(thread->driver_errors().size() == 1);
  while (glGetError() != GL_NO_ERROR) {
  }
}
#endif
