#include "render/slot_pool.h"

#include <algorithm>

#include <epoxy/gl.h>

namespace tellurion::render {
namespace {

constexpr std::size_t kLayersPerArray = 16;

}  // namespace

std::size_t SlotFormat::slot_bytes() const {
  std::size_t texels = 0;
  for (int level = 0; level < levels; ++level) {
    const auto level_side = static_cast<std::size_t>(std::max(side >> level, 1));
    texels += level_side * level_side;
  }
  return texels * texel_bytes;
}

std::size_t SlotPool::layers_to_add(const Budget& budget) const {
  const std::size_t room = std::min(budget.left(), cap_bytes_ - std::min(cap_bytes_, allocated_bytes_));
  return std::min(room / format_.slot_bytes(), kLayersPerArray);
}

std::optional<Slot> SlotPool::acquire(const gpu::RenderThread& thread, Budget& budget) {
  for (std::uint32_t a = 0; a < arrays_.size(); ++a) {
    auto& layers = arrays_[a].free_layers;
    if (layers.empty()) continue;
    const std::uint32_t layer = layers.back();
    layers.pop_back();
    return Slot{a, layer};
  }
  const std::size_t layers = layers_to_add(budget);
  if (layers == 0) return std::nullopt;

  Array array{gpu::Texture(thread), layers, {}};
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D_ARRAY, array.texture.name());
  // Before the images: a driver allocates a whole chain of levels for a filter that asks for it, and that is a new texture's.
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, format_.levels - 1);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, format_.min_filter);
  for (int level = 0; level < format_.levels; ++level) {
    const int side = std::max(format_.side >> level, 1);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, level, static_cast<GLint>(format_.internal), side, side, static_cast<GLsizei>(layers),
                 0, format_.external, format_.type, nullptr);
  }
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  for (std::size_t layer = layers; layer-- > 1;) array.free_layers.push_back(static_cast<std::uint32_t>(layer));
  allocated_bytes_ += layers * format_.slot_bytes();
  budget.used += layers * format_.slot_bytes();
  auto place = std::find_if(arrays_.begin(), arrays_.end(), [](const Array& other) { return other.layers == 0; });
  if (place == arrays_.end()) place = arrays_.insert(place, Array{});
  *place = std::move(array);
  return Slot{static_cast<std::uint32_t>(place - arrays_.begin()), 0};
}

bool SlotPool::give_back(gpu::RenderThread& thread, Budget& budget) {
  bool given = false;
  for (Array& array : arrays_) {
    if (array.layers == 0 || array.free_layers.size() < array.layers) continue;
    allocated_bytes_ -= array.layers * format_.slot_bytes();
    budget.used -= array.layers * format_.slot_bytes();
    array = Array{};
    given = true;
  }
  if (given) thread.empty_graveyard();  // else new ones would stand beside them until the next frame
  return given;
}

void SlotPool::release(Slot slot) { arrays_[slot.array].free_layers.push_back(slot.layer); }

std::size_t SlotPool::free_slots(const Budget& budget) const {
  const std::size_t room = std::min(budget.left(), cap_bytes_ - std::min(cap_bytes_, allocated_bytes_));
  std::size_t count = room / format_.slot_bytes();
  for (const Array& array : arrays_) count += array.free_layers.size();
  return count;
}

}  // namespace tellurion::render
