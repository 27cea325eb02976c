#include "render/renderer.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <epoxy/gl.h>

#include "render/frame_block.h"
#include "render/geo_picture.h"
#include "render/sky_pass.h"
#include "render/surface_pass.h"
#include "render/target.h"
#include "render/tile_store.h"

namespace tellurion::render {
namespace {

using surface::DrawTile;

constexpr int kSamples = 4;

std::uint32_t features_of(const FrameLook& look, const RendererOptions& options, bool reversed) {
  return (look.lighting ? SurfacePass::light : 0u) | (look.atmosphere && options.air ? SurfacePass::atmosphere : 0u) |
         (look.tile_borders ? SurfacePass::borders : 0u) | (reversed ? 0u : SurfacePass::log_depth) |
         (options.slots.overlays ? SurfacePass::overlay : 0u) | (options.slots.normals ? SurfacePass::normals : 0u);
}

/// What of a look drivers compile for.
struct LookPrograms {
  std::uint32_t features;
  bool wireframe, bounds, antialiasing;
  friend bool operator==(const LookPrograms&, const LookPrograms&) = default;
};

/// A triangle that the camera sees.
surface::TileGeometry triangle_before(const view::Camera& camera) {
  surface::TileGeometry geometry;
  surface::TileMesh& mesh = geometry.mesh;
  mesh.origin_base = camera.eye + 10.0 * camera.forward();
  mesh.origin_up = -camera.forward();
  for (const glm::dvec2 corner : {glm::dvec2(-1, -1), glm::dvec2(1, -1), glm::dvec2(0, 1)}) {
    surface::TileVertex vertex{};
    vertex.base = glm::vec3(corner.x * camera.axes[0] + corner.y * camera.axes[1]);
    vertex.st = glm::vec2(corner);
    mesh.vertices.push_back(vertex);
  }
  mesh.indices = {0, 1, 2};
  mesh.steps = {{0, 3, 3}};
  geometry.slopes.tangent = {camera.axes[0]};
  return geometry;
}

/// Of one texel.
surface::TileImagery imagery_of_a_texel(bool has_effects, bool has_overlay, bool has_normals) {
  surface::ImagePatch patch;
  patch.image = {1, 1, {255, 255, 255, 255}};
  patch.columns = patch.rows = 1;
  patch.image_points = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  surface::TileImagery imagery;
  imagery.patches = {patch};
  patch.use = surface::ImageUse::overlay;
  if (has_overlay) imagery.overlays = {patch};
  patch.use = surface::ImageUse::normal;
  if (has_normals) imagery.normals = {patch};
  patch.use = surface::ImageUse::night;
  if (has_effects) imagery.effects = {std::move(patch)};
  return imagery;
}

}  // namespace

struct Renderer::State {
  State(gpu::RenderThread& thread, const RendererOptions& asked, Compositor compositor, SkyPass sky_pass)
      : options(asked),
        store(thread, asked.gpu_budget_bytes, std::move(compositor)),
        surface(thread, asked.ellipsoid),
        sky(std::move(sky_pass)),
        frame_buffer(thread),
        smooth(GL_RGBA8, std::min(kSamples, thread.capabilities().max_samples)) {
    glBindBuffer(GL_UNIFORM_BUFFER, frame_buffer.name());
    glBufferData(GL_UNIFORM_BUFFER, sizeof(FrameBlock), nullptr, GL_STREAM_DRAW);
  }

  /// Clears `target` and sets up depth and the frame's block.
  void begin(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look, Target& target);
  void end(gpu::RenderThread& thread);
  /// Draws all that `look` asks for into `target`.
  FrameFigures draw_passes(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                           std::span<const DrawTile> tiles, Target& target);
  /// Draws into `plain`, by way of `smooth` if asked.
  FrameFigures draw_plain(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                          std::span<const DrawTile> tiles);

  RendererOptions options;
  TileStore store;
  SurfacePass surface;
  SkyPass sky;
  gpu::Buffer frame_buffer;
  Target plain{GL_RGBA8};
  Target smooth;
  Target measured{GL_R32UI};
  std::vector<LookPrograms> warm;
};

Result<std::unique_ptr<Renderer>> Renderer::create(gpu::RenderThread& thread, const RendererOptions& options) {
  auto compositor = Compositor::create(thread);
  if (!compositor) return compositor.error();
  auto sky = SkyPass::create(thread);
  if (!sky) return sky.error();
  auto state = std::make_unique<State>(thread, options, std::move(*compositor), std::move(*sky));
  const std::uint32_t features = features_of({}, options, thread.capabilities().clip_control);
  if (auto prepared = state->surface.prepare(thread, features); !prepared) return prepared.error();
  if (auto warmed = state->store.warm_up(thread); !warmed) return warmed.error();
  std::unique_ptr<Renderer> renderer(new Renderer(std::move(state)));
  renderer->warm_up(thread, {});
  glReleaseShaderCompiler();  // some megabytes, of use again only when a switch is thrown
  return renderer;
}

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() = default;

Result<void> Renderer::upload_geometry(gpu::RenderThread& thread, const geo::TileKey& key,
                                       const surface::TileGeometry& geometry) {
  thread.check();
  return state_->store.upload_geometry(thread, key, geometry);
}

Result<void> Renderer::upload_colour(gpu::RenderThread& thread, const geo::TileKey& key,
                                     const surface::TileImagery& imagery, bool fades) {
  thread.check();
  return state_->store.upload_colour(thread, key, imagery, fades);
}

void Renderer::advance_renewals(gpu::RenderThread& thread, float share) {
  thread.check();
  state_->store.advance_renewals(share);
}

void Renderer::release(gpu::RenderThread& thread, const geo::TileKey& key, surface::Part part) {
  thread.check();
  state_->store.release(key, part);
}

std::size_t Renderer::gpu_bytes() const { return state_->store.budget().used; }
std::size_t Renderer::gpu_budget_bytes() const { return state_->store.budget().limit; }
std::uint64_t Renderer::bytes_uploaded() const { return state_->store.bytes_uploaded(); }
std::size_t Renderer::colour_slots_free() const { return state_->store.colour_slots_free(); }

void Renderer::State::begin(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look, Target& target) {
  const bool reversed = thread.capabilities().clip_control;
  target.resize(thread, camera.width, camera.height, store.budget());
  const FrameBlock block = make_frame_block(camera, look, options, reversed);
  glBindBuffer(GL_UNIFORM_BUFFER, frame_buffer.name());
  glBufferSubData(GL_UNIFORM_BUFFER, 0, sizeof block, &block);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_buffer.name());

  glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer());
  glViewport(0, 0, camera.width, camera.height);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_STENCIL_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glEnable(GL_CULL_FACE);
  glCullFace(GL_BACK);
  glFrontFace(GL_CCW);
  if (reversed) {
    thread.capabilities().is_es ? glClipControlEXT(GL_LOWER_LEFT_EXT, GL_ZERO_TO_ONE_EXT)
                                : glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  }
  glDepthFunc(reversed ? GL_GEQUAL : GL_LEQUAL);
  const GLfloat far = reversed ? 0.0f : 1.0f;
  glClearBufferfv(GL_DEPTH, 0, &far);
}

void Renderer::State::end(gpu::RenderThread& thread) {
  if (thread.capabilities().clip_control) {
    thread.capabilities().is_es ? glClipControlEXT(GL_LOWER_LEFT_EXT, GL_NEGATIVE_ONE_TO_ONE_EXT)
                                : glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  }
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
}

FrameFigures Renderer::State::draw_passes(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                                          std::span<const DrawTile> tiles, Target& target) {
  begin(thread, camera, look, target);
  const glm::vec4 clear(look.clear, 1.0f);
  glClearBufferfv(GL_COLOR, 0, &clear.x);

  const std::uint32_t features = features_of(look, options, thread.capabilities().clip_control);
  surface.set_anisotropy(thread, look.anisotropy);
  FrameFigures figures = surface.draw(thread, camera, look.exaggeration, look.to_sun.xyz, features, tiles, store);
  if (look.wireframe) {
    const std::uint32_t depth = features & SurfacePass::log_depth;
    figures.draws += surface.draw(thread, camera, look.exaggeration, look.to_sun.xyz, SurfacePass::wireframe | depth, tiles, store).draws;
  }
  if (look.bounds) surface.draw_boxes(thread, camera, look.exaggeration, features, tiles, store);
  if (look.atmosphere && options.air) {
    glDisable(GL_CULL_FACE);
    sky.draw(thread);
    ++figures.draws;
  }
  end(thread);
  return figures;
}

FrameFigures Renderer::State::draw_plain(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                                         std::span<const DrawTile> tiles) {
  thread.empty_graveyard();
  if (!look.antialiasing) {
    smooth.release(store.budget());
    return draw_passes(thread, camera, look, tiles, plain);
  }
  const FrameFigures figures = draw_passes(thread, camera, look, tiles, smooth);
  plain.resize(thread, camera.width, camera.height, store.budget());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, smooth.framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, plain.framebuffer());
  glBlitFramebuffer(0, 0, camera.width, camera.height, 0, 0, camera.width, camera.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  return figures;
}

void Renderer::allow(gpu::RenderThread& thread, const OptionalSlots& slots) {
  thread.check();
  OptionalSlots& allowed = state_->options.slots;
  allowed = {allowed.overlays || slots.overlays, allowed.normals || slots.normals};
}

bool Renderer::warm_up(gpu::RenderThread& thread, const FrameLook& look) {
  // One triangle through every variant, into targets of the same kinds: drivers compile at the first draw.
  thread.check();
  State& s = *state_;
  const LookPrograms programs{features_of(look, s.options, thread.capabilities().clip_control), look.wireframe, look.bounds,
                              look.antialiasing};
  if (std::find(s.warm.begin(), s.warm.end(), programs) != s.warm.end()) return false;
  s.warm.push_back(programs);
  view::Camera camera;
  camera.width = camera.height = 16;
  camera.eye = {{2.0 * s.options.ellipsoid.a(), 0.0, 0.0}};
  std::vector<DrawTile> tiles;
  for (std::uint8_t i = 0; i < 8; ++i) {
    const bool has_effects = (i & 1) != 0, has_overlay = (i & 2) != 0, has_normals = (i & 4) != 0;
    if ((has_overlay && !s.options.slots.overlays) || (has_normals && !s.options.slots.normals)) continue;
    const geo::TileKey key{.face = static_cast<std::uint8_t>(geo::kFaceCount + i)};  // no tile of the planet
    if (!s.store.upload_geometry(thread, key, triangle_before(camera))) break;
    DrawTile tile{.key = key, .colour_owner = key, .colour_before = key, .slope_owner = key};
    tiles.push_back(tile);
    if (!s.store.upload_colour(thread, key, imagery_of_a_texel(has_effects, has_overlay, has_normals))) break;
    tile.colour_before.face = 0;
    tile.fade = 0.5f;
    tiles.push_back(tile);
  }
  Target target(GL_RGBA8, look.antialiasing ? std::min(kSamples, thread.capabilities().max_samples) : 1);
  s.draw_passes(thread, camera, look, tiles, target);
  glFinish();
  target.release(s.store.budget());
  for (const DrawTile& tile : tiles) {
    for (const surface::Part part : {surface::Part::geometry, surface::Part::colour}) s.store.release(tile.key, part);
  }
  return true;
}

FrameFigures Renderer::draw(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                            std::span<const DrawTile> tiles, unsigned framebuffer) {
  thread.check();
  if (camera.width <= 0 || camera.height <= 0) return {};  // a minimised window
  const FrameFigures figures = state_->draw_plain(thread, camera, look, tiles);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, state_->plain.framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glBlitFramebuffer(0, 0, camera.width, camera.height, 0, 0, camera.width, camera.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  return figures;
}

raster::Image Renderer::picture(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                                std::span<const DrawTile> tiles) {
  thread.check();
  state_->draw_plain(thread, camera, look, tiles);
  return last_picture(thread);
}

raster::Image Renderer::last_picture(gpu::RenderThread& thread) {
  thread.check();
  const int width = state_->plain.width(), height = state_->plain.height();
  raster::Image image{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4)};
  if (image.rgba.empty()) return image;
  glBindFramebuffer(GL_FRAMEBUFFER, state_->plain.framebuffer());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
  glBindFramebuffer(GL_FRAMEBUFFER, 0);

  // Bottom up, as OpenGL has it.
  const auto row_bytes = static_cast<std::ptrdiff_t>(width) * 4;
  for (int y = 0; y < height / 2; ++y) {
    const auto upper = image.rgba.begin() + y * row_bytes, lower = image.rgba.begin() + (height - 1 - y) * row_bytes;
    std::swap_ranges(upper, upper + row_bytes, lower);
  }
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

GeoPicture Renderer::measure(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                             std::span<const DrawTile> tiles) {
  thread.check();
  thread.empty_graveyard();
  State& s = *state_;
  s.begin(thread, camera, look, s.measured);
  const GLuint sky[4] = {};
  glClearBufferuiv(GL_COLOR, 0, sky);
  const std::uint32_t depth = thread.capabilities().clip_control ? 0u : SurfacePass::log_depth;
  s.surface.draw(thread, camera, look.exaggeration, look.to_sun.xyz, SurfacePass::measure | depth, tiles, s.store);
  s.end(thread);

  // OpenGL ES promises only this format for unsigned integers.
  constexpr std::size_t kWords = 4;
  std::vector<std::uint32_t> nearness(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height) * kWords);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, camera.width, camera.height, GL_RGBA_INTEGER, GL_UNSIGNED_INT, nearness.data());
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  s.measured.release(s.store.budget());
  return locate_pixels(s.options.ellipsoid, camera, nearness, kWords);
}

}  // namespace tellurion::render
