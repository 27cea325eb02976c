// Draws image patches into colour slots and makes their smaller levels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "gpu/program.h"
#include "render/budget.h"
#include "render/slot_pool.h"
#include "surface/tile_content.h"

namespace tellurion::render {

class Compositor {
 public:
  static Result<Compositor> create(gpu::RenderThread& thread);

  /// Fills `slot` with the patches, lowest first; what none covers is transparent. Those of grayscale give their brightness to
  /// what lies below them: it becomes the V of HSV. Every patch must have an image that a texture can hold and
  /// (columns + 1) * (rows + 1) points (asserted).
  Result<void> compose(gpu::RenderThread& thread, std::span<const surface::ImagePatch> patches, const SlotPool& pool,
                       Slot slot, Budget& budget);
  /// The same with patches of night and water: the light of the night becomes the slot's red, green and blue, the share of water its
  /// alpha, neither of them weighted by the other.
  Result<void> compose_effects(gpu::RenderThread& thread, std::span<const surface::ImagePatch> patches, const SlotPool& pool,
                               Slot slot, Budget& budget);

 private:
  /// A texture that patches' images are put into one after the other, at its lower corner.
  struct Scratch {
    int width = 0;
    int height = 0;
    std::uint64_t last_use = 0;
    gpu::Texture texture;

    std::size_t bytes() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4; }
  };

  Compositor(gpu::RenderThread& thread, gpu::ProgramFamily programs, gpu::ProgramFamily reduce_programs);
  Scratch& scratch_for(gpu::RenderThread& thread, const raster::Image& image, Budget& budget);
  void upload_cells(const surface::ImagePatch& patch);
  void begin(const SlotPool& pool, Slot slot);
  /// Keeps what has been drawn into the slot so far, for the next patch to read.
  void keep_below();
  Result<void> draw(gpu::RenderThread& thread, const surface::ImagePatch& patch, Budget& budget);
  Result<void> make_levels(gpu::RenderThread& thread, const SlotPool& pool, Slot slot);

  gpu::ProgramFamily programs_;
  gpu::ProgramFamily reduce_programs_;
  gpu::VertexArray array_;
  gpu::VertexArray no_array_;  // for draws that need no vertices
  gpu::Buffer cells_;
  gpu::Framebuffer target_;
  gpu::Texture below_;         // a slot's first level as it was before a patch
  std::vector<Scratch> scratch_;
  std::vector<float> cell_points_;
  std::uint64_t use_ = 0;
};

}  // namespace tellurion::render
