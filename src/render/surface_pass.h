// Draws the tiles of a cut: shaded, as lines, as boxes, or measured.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "base/result.h"
#include "gpu/program.h"
#include "render/renderer.h"
#include "render/tile_store.h"
#include "surface/draw_list.h"
#include "view/camera.h"

namespace tellurion::render {

class SurfacePass {
 public:
  /// What a variant of the surface's program does; bits of its features.
  enum Feature : std::uint32_t { light = 1, atmosphere = 2, fade = 4, borders = 8, wireframe = 16, measure = 32, log_depth = 64, effects = 128, overlay = 256, normals = 512 };

  SurfacePass(gpu::RenderThread& thread, const geo::Ellipsoid& ellipsoid);

  /// Compiles what draw() needs for the same features. Errors: internal.
  Result<void> prepare(gpu::RenderThread& thread, std::uint32_t features);

  /// The frame's block must be bound and depth be set up. `features` holds `overlay` and `normals` where tiles may have some, never
  /// `effects` or `fade`: each tile has its own of the four.
  /// `to_sun`: unit vector in Ecef axes, of use with `light` only.
  FrameFigures draw(gpu::RenderThread& thread, const view::Camera& camera, double exaggeration, const glm::dvec3& to_sun, std::uint32_t features,
                    std::span<const surface::DrawTile> tiles, const TileStore& store);
  void draw_boxes(gpu::RenderThread& thread, const view::Camera& camera, double exaggeration, std::uint32_t features,
                  std::span<const surface::DrawTile> tiles, const TileStore& store);

  void set_anisotropy(const gpu::RenderThread& thread, double anisotropy);

 private:
  /// The programs for some features, by what tiles add to them (see TileVariant).
  using Variants = std::array<const gpu::LinkedProgram*, 16>;
  Result<Variants> variants(gpu::RenderThread& thread, std::uint32_t features);
  /// Binds a texture array unless it is bound.
  void bind(unsigned unit, unsigned texture);

  geo::Ellipsoid ellipsoid_;
  gpu::ProgramFamily programs_;
  gpu::ProgramFamily box_programs_;
  gpu::VertexArray box_array_;
  gpu::Buffer box_edges_;
  gpu::Sampler colour_sampler_;
  float anisotropy_ = 1.0f;
  unsigned bound_[6] = {};
};

}  // namespace tellurion::render
