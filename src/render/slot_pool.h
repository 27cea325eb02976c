// Equal square textures kept as layers of texture arrays, allocated as needed and used again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/object.h"
#include "render/budget.h"

namespace tellurion::render {

/// A layer of one of a pool's arrays.
struct Slot {
  std::uint32_t array = 0;
  std::uint32_t layer = 0;
};

/// What a pool's textures are.
struct SlotFormat {
  int side = 0;                ///< texels
  int levels = 1;
  unsigned internal = 0;       ///< OpenGL's names of the format
  unsigned external = 0;
  unsigned type = 0;
  std::size_t texel_bytes = 0;
  int min_filter = 0;

  std::size_t slot_bytes() const;
};

class SlotPool {
 public:
  /// At most `cap_bytes` in all, as far as `budget` has room.
  SlotPool(SlotFormat format, std::size_t cap_bytes) : format_(format), cap_bytes_(cap_bytes) {}

  /// A free slot of undefined content; nothing if there is neither one nor room for more.
  std::optional<Slot> acquire(const gpu::RenderThread& thread, Budget& budget);
  void release(Slot slot);
  /// Frees the arrays that have no slot in use, at once; true if there were any.
  bool give_back(gpu::RenderThread& thread, Budget& budget);

  unsigned texture(Slot slot) const { return arrays_[slot.array].texture.name(); }
  const SlotFormat& format() const { return format_; }
  /// Slots that acquire could still give.
  std::size_t free_slots(const Budget& budget) const;

 private:
  struct Array {
    gpu::Texture texture;
    std::size_t layers = 0;                  // 0: given back, its place may be used again
    std::vector<std::uint32_t> free_layers;  // the next one last
  };

  std::size_t layers_to_add(const Budget& budget) const;

  SlotFormat format_;
  std::size_t cap_bytes_;
  std::size_t allocated_bytes_ = 0;
  std::vector<Array> arrays_;
};

}  // namespace tellurion::render
