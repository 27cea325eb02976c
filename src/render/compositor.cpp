#include "render/compositor.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include <epoxy/gl.h>

#include "render/pass_source.h"

namespace tellurion::render {
namespace {

using surface::ImagePatch;

constexpr std::uint32_t kAdjust = 1, kMask = 2, kGrayscale = 4;  // feature bits
constexpr std::size_t kMaxScratch = 8;
enum Uniform { u_slot_range, u_cells, u_image_texels, u_extent, u_pixel, u_feather, u_adjust };

constexpr float kSide = surface::kColourSlotSide;
constexpr float kGutter = surface::kColourGutter;

/// Tile coordinates -> clip coordinates of the slot.
float to_clip(float st) { return 2.0f * (kGutter + st * (kSide - 2.0f * kGutter)) / kSide - 1.0f; }

/// Whether nothing below the patch can be seen.
bool hides_all(const ImagePatch& p) {
  constexpr float kEdge = 1.0f - 1e-3f / kSide;
  return p.use != surface::ImageUse::grayscale && p.opaque && p.opacity >= 1.0f && to_clip(p.lower.x) <= -kEdge && to_clip(p.lower.y) <= -kEdge &&
         to_clip(p.upper.x) >= kEdge && to_clip(p.upper.y) >= kEdge;
}

int size_class(int size) { return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(size, 64)))); }

}  // namespace

Result<Compositor> Compositor::create(gpu::RenderThread& thread) {
  gpu::ProgramFamily programs({shader_texts({"compose.vert"}),
                               shader_texts({"compose.frag"}),
                               {"ADJUST", "MASK", "GRAYSCALE"},
                               {"u_slot_range", "u_cells", "u_image_texels", "u_extent", "u_pixel", "u_feather", "u_adjust"},
                               {"u_image", "u_below"},
                               {}});
  for (const std::uint32_t features : {0u, kAdjust, kMask, kAdjust | kMask, kGrayscale, kAdjust | kGrayscale}) {
    const auto program = programs.variant(thread, features);
    if (!program) return program.error();
  }
  gpu::ProgramFamily reduce({shader_texts({"reduce.vert"}), shader_texts({"reduce.frag"}), {}, {"u_layer"}, {"u_slots"}, {}});
  if (const auto program = reduce.variant(thread, 0); !program) return program.error();
  return Compositor(thread, std::move(programs), std::move(reduce));
}

Compositor::Compositor(gpu::RenderThread& thread, gpu::ProgramFamily programs, gpu::ProgramFamily reduce_programs)
    : programs_(std::move(programs)),
      reduce_programs_(std::move(reduce_programs)),
      array_(thread),
      no_array_(thread),
      cells_(thread),
      target_(thread),
      below_(thread) {
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, below_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, surface::kColourSlotSide, surface::kColourSlotSide, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  scratch_.reserve(kMaxScratch + 1);
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, cells_.name());
  for (GLuint location = 0; location < 2; ++location) {
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, 4, GL_FLOAT, GL_FALSE, 8 * sizeof(float),
                          reinterpret_cast<const void*>(location * 4 * sizeof(float)));
    glVertexAttribDivisor(location, 1);
  }
  glBindVertexArray(0);
}

void Compositor::begin(const SlotPool& pool, Slot slot) {
  glBindFramebuffer(GL_FRAMEBUFFER, target_.name());
  glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, pool.texture(slot), 0, static_cast<GLint>(slot.layer));
  glViewport(0, 0, pool.format().side, pool.format().side);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void Compositor::keep_below() {
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, below_.name());
  glCopyTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 0, 0, surface::kColourSlotSide, surface::kColourSlotSide);
  glActiveTexture(GL_TEXTURE0);
}

Result<void> Compositor::compose(gpu::RenderThread& thread, std::span<const ImagePatch> patches, const SlotPool& pool,
                                 Slot slot, Budget& budget) {
  begin(pool, slot);
  const auto top = std::find_if(patches.rbegin(), patches.rend(), hides_all);
  const auto first = top == patches.rend() ? patches.begin() : std::prev(top.base());
  if (top == patches.rend()) {
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT);
  }
  for (auto patch = first; patch != patches.end(); ++patch) {
    if (auto drawn = draw(thread, *patch, budget); !drawn) return drawn;
  }
  glDisable(GL_BLEND);
  return make_levels(thread, pool, slot);
}

Result<void> Compositor::compose_effects(gpu::RenderThread& thread, std::span<const ImagePatch> patches, const SlotPool& pool,
                                         Slot slot, Budget& budget) {
  begin(pool, slot);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  for (const ImagePatch& patch : patches) {
    const GLboolean is_water = patch.use == surface::ImageUse::water;
    glColorMask(!is_water, !is_water, !is_water, is_water);
    if (auto drawn = draw(thread, patch, budget); !drawn) return drawn;
  }
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDisable(GL_BLEND);
  return make_levels(thread, pool, slot);
}

Result<void> Compositor::draw(gpu::RenderThread& thread, const ImagePatch& patch, Budget& budget) {
  assert(patch.columns > 0 && patch.rows > 0 && patch.image.width > 0 && patch.image.height > 0);
  const bool adjusts = patch.gamma != 1.0f || patch.multiplier != 1.0f;
  const bool is_mask = patch.use == surface::ImageUse::water, is_grayscale = patch.use == surface::ImageUse::grayscale;
  const auto program = programs_.variant(thread, (adjusts ? kAdjust : 0u) | (is_mask ? kMask : 0u) | (is_grayscale ? kGrayscale : 0u));
  if (!program) return program.error();
  const glm::vec2 size(patch.image.width, patch.image.height), feather = patch.feather * size;
  const bool is_soft_mask = is_mask && feather.x > 0.0f;  // the slot's other channels are none of its own: the shader mixes
  if (is_grayscale || is_soft_mask) keep_below();

  const Scratch& scratch = scratch_for(thread, patch.image, budget);
  const GLint filter = patch.linear ? GL_LINEAR : GL_NEAREST;
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, patch.image.width, patch.image.height, GL_RGBA, GL_UNSIGNED_BYTE,
                  patch.image.rgba.data());
  upload_cells(patch);

  const auto& locations = (*program)->locations;
  glUseProgram((*program)->program.name());
  glUniform4f(locations[u_slot_range], to_clip(patch.lower.x), to_clip(patch.lower.y), to_clip(patch.upper.x),
              to_clip(patch.upper.y));
  glUniform2i(locations[u_cells], patch.columns, patch.rows);
  glUniform4f(locations[u_image_texels], static_cast<float>(patch.image.width), static_cast<float>(patch.image.height),
              static_cast<float>(scratch.width), static_cast<float>(scratch.height));
  const glm::vec2 lower = patch.data_lower * size, upper = patch.data_upper * size, pixel = patch.data_pixel * size;
  glUniform4f(locations[u_extent], lower.x, lower.y, upper.x, upper.y);
  glUniform2f(locations[u_pixel], pixel.x, pixel.y);
  glUniform2f(locations[u_feather], feather.x, feather.y);
  glUniform3f(locations[u_adjust], patch.opacity, patch.gamma, patch.multiplier);
  if (is_soft_mask) {
    glDisable(GL_BLEND);
  } else if (is_mask) {  // drawn where the image is, by the opacity of the layer
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendColor(0, 0, 0, patch.opacity);
    glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
  } else if (patch.opaque && patch.opacity >= 1.0f) {
    glDisable(GL_BLEND);
  } else {
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  }
  glBindVertexArray(array_.name());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, patch.columns * patch.rows);
  glBindVertexArray(0);
  return {};
}

Compositor::Scratch& Compositor::scratch_for(gpu::RenderThread& thread, const raster::Image& image, Budget& budget) {
  const int width = size_class(image.width);
  const int height = size_class(image.height);
  glActiveTexture(GL_TEXTURE0);
  ++use_;
  for (Scratch& s : scratch_) {
    if (s.width != width || s.height != height) continue;
    s.last_use = use_;
    glBindTexture(GL_TEXTURE_2D, s.texture.name());
    return s;
  }
  const Scratch wanted{width, height, use_, gpu::Texture()};
  const std::size_t count_before = scratch_.size();
  while (scratch_.size() == kMaxScratch || (!scratch_.empty() && !budget.fits(wanted.bytes()))) {
    const auto oldest = std::min_element(scratch_.begin(), scratch_.end(),
                                         [](const Scratch& a, const Scratch& b) { return a.last_use < b.last_use; });
    budget.used -= oldest->bytes();
    scratch_.erase(oldest);
  }
  if (scratch_.size() < count_before) {
    thread.empty_graveyard();  // else those of many patches would pile up until the next frame
    glFlush();                 // and until the driver draws what reads them
  }
  Scratch& s = scratch_.emplace_back(Scratch{width, height, use_, gpu::Texture(thread)});
  budget.used += s.bytes();
  glBindTexture(GL_TEXTURE_2D, s.texture.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return s;
}

void Compositor::upload_cells(const ImagePatch& patch) {
  const auto columns = static_cast<std::size_t>(patch.columns);
  const auto rows = static_cast<std::size_t>(patch.rows);
  assert(patch.image_points.size() == (columns + 1) * (rows + 1));
  cell_points_.clear();
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      for (std::size_t corner = 0; corner < 4; ++corner) {
        const glm::vec2 point = patch.image_points[(row + corner / 2) * (columns + 1) + column + corner % 2];
        cell_points_.push_back(point.x);
        cell_points_.push_back(point.y);
      }
    }
  }
  glBindBuffer(GL_ARRAY_BUFFER, cells_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(cell_points_.size() * sizeof(float)), cell_points_.data(),
               GL_STREAM_DRAW);
}

Result<void> Compositor::make_levels(gpu::RenderThread& thread, const SlotPool& pool, Slot slot) {
  // Not glGenerateMipmap: that would make the levels of the whole array.
  const auto program = reduce_programs_.variant(thread, 0);
  if (!program) return program.error();
  glUseProgram((*program)->program.name());
  glUniform1i((*program)->locations[0], static_cast<GLint>(slot.layer));
  glBindVertexArray(no_array_.name());
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D_ARRAY, pool.texture(slot));
  for (int level = 1; level < pool.format().levels; ++level) {
    // Only the larger level can be read, so that drawing into the smaller one is no feedback.
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BASE_LEVEL, level - 1);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, level - 1);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, pool.texture(slot), level,
                              static_cast<GLint>(slot.layer));
    glViewport(0, 0, pool.format().side >> level, pool.format().side >> level);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BASE_LEVEL, 0);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, pool.format().levels - 1);
  glBindVertexArray(0);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  return {};
}

}  // namespace tellurion::render
