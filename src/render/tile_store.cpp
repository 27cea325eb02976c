#include "render/tile_store.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include <epoxy/gl.h>

namespace tellurion::render {
namespace {

// Geometry, slopes and targets keep the rest, so that colour cannot starve them.
constexpr double kColourShare = 0.7;

SlotFormat colour_format() {
  return {surface::kColourSlotSide, 9, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, GL_LINEAR_MIPMAP_LINEAR};
}

SlotFormat slope_format() {
  return {surface::kSlopeSlotSide, 6, GL_RG16F, GL_RG, GL_FLOAT, 4, GL_LINEAR_MIPMAP_NEAREST};
}

/// A layer of zeros. It has a smaller level like the slots, so that drivers compile nothing anew for it.
gpu::Texture empty_layer(gpu::RenderThread& thread, const SlotFormat& format) {
  gpu::Texture texture(thread);
  const float zeros[2 * 2 * 4] = {};
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
  for (int level = 0; level < 2; ++level) {
    const int side = 2 >> level;
    glTexImage3D(GL_TEXTURE_2D_ARRAY, level, static_cast<GLint>(format.internal), side, side, 1, 0, format.external,
                 format.type, zeros);
  }
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 1);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, format.min_filter);
  return texture;
}

/// Halves the side of a square of texels in place by taking means.
void halve(std::vector<glm::vec2>& texels, std::size_t side) {
  const std::size_t half = side / 2;
  for (std::size_t y = 0; y < half; ++y) {
    for (std::size_t x = 0; x < half; ++x) {
      const std::size_t o = 2 * y * side + 2 * x;
      texels[y * half + x] = 0.25f * (texels[o] + texels[o + 1] + texels[o + side] + texels[o + side + 1]);
    }
  }
}

}  // namespace

TileStore::TileStore(gpu::RenderThread& thread, std::size_t budget_bytes, Compositor compositor)
    : budget_{budget_bytes, 0},
      compositor_(std::move(compositor)),
      colours_(colour_format(), static_cast<std::size_t>(kColourShare * static_cast<double>(budget_bytes))),
      slopes_(slope_format(), budget_bytes),
      no_colour_(empty_layer(thread, colour_format())),
      no_slope_(empty_layer(thread, slope_format())) {}

Result<void> TileStore::warm_up(gpu::RenderThread& thread) {
  SlotPool pool(colour_format(), colour_format().slot_bytes());
  Budget budget{pool.format().slot_bytes(), 0};
  const auto slot = pool.acquire(thread, budget);
  surface::ImagePatch plain;
  plain.image = {1, 1, {255, 255, 255, 255}};
  plain.columns = plain.rows = 1;
  plain.image_points = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  std::vector<surface::ImagePatch> patches(6, plain);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    patches[i].opaque = i / 2 == 0;  // two of each: replacing, blended, adjusted
    patches[i].gamma = i / 2 == 2 ? 2.0f : 1.0f;
    patches[i].linear = i % 2 == 0;
    patches[i].upper = glm::vec2(0.5f);
  }
  if (auto composed = compositor_.compose(thread, patches, pool, *slot, budget_); !composed) return composed;
  for (surface::ImagePatch& patch : patches) patch.use = surface::ImageUse::grayscale;
  if (auto composed = compositor_.compose(thread, patches, pool, *slot, budget_); !composed) return composed;
  for (std::size_t i = 0; i < patches.size(); ++i) patches[i].use = i % 2 == 0 ? surface::ImageUse::night : surface::ImageUse::water;
  return compositor_.compose_effects(thread, patches, pool, *slot, budget_);
}

bool TileStore::has_room(gpu::RenderThread& thread, std::size_t bytes) {
  return budget_.fits(bytes) || (colours_.give_back(thread, budget_) && budget_.fits(bytes)) || (slopes_.give_back(thread, budget_) && budget_.fits(bytes));
}

Result<void> TileStore::upload_geometry(gpu::RenderThread& thread, const geo::TileKey& key,
                                        const surface::TileGeometry& geometry) {
  release(key, surface::Part::geometry);
  const Error full{ErrorCode::exhausted, "the GPU budget has no room for the geometry of tile " + geo::to_string(key)};
  if (!has_room(thread, geometry.mesh.bytes())) return full;
  std::optional<Slot> slot;
  if (!geometry.slopes.slopes.empty()) {
    slot = slopes_.acquire(thread, budget_);
    if (!slot && colours_.give_back(thread, budget_)) slot = slopes_.acquire(thread, budget_);
    if (!slot) return full;
    if (!has_room(thread, geometry.mesh.bytes())) {  // the slopes needed a new array
      slopes_.release(*slot);
      return full;
    }
    upload_slopes(*slot, geometry.slopes);
  }
  ResidentTile& tile = tiles_[key];
  tile.mesh = std::make_unique<ResidentMesh>(thread, geometry.mesh, budget_);
  tile.slopes = slot;
  tile.tangent = geometry.slopes.tangent.xyz;
  bytes_uploaded_ += geometry.mesh.bytes() + (slot ? slopes_.format().slot_bytes() : 0);
  return {};
}

void TileStore::upload_slopes(Slot slot, const surface::SlopeMap& map) {
  auto side = static_cast<std::size_t>(slopes_.format().side);
  assert(map.slopes.size() == side * side);
  slope_level_ = map.slopes;
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D_ARRAY, slopes_.texture(slot));
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (int level = 0; level < slopes_.format().levels; ++level) {
    if (level > 0) {
      halve(slope_level_, side);
      side /= 2;
    }
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, level, 0, 0, static_cast<GLint>(slot.layer), static_cast<GLsizei>(side),
                    static_cast<GLsizei>(side), 1, GL_RG, GL_FLOAT, slope_level_.data());
  }
}

std::optional<Slot> TileStore::acquire_colour(gpu::RenderThread& thread) {
  auto slot = colours_.acquire(thread, budget_);
  if (!slot && slopes_.give_back(thread, budget_)) slot = colours_.acquire(thread, budget_);
  return slot;
}

void TileStore::release_colour(std::optional<Slot>& slot) {
  if (slot) colours_.release(*slot);
  slot.reset();
}

Result<void> TileStore::upload_colour(gpu::RenderThread& thread, const geo::TileKey& key,
                                      const surface::TileImagery& imagery, bool fades) {
  const auto known = tiles_.find(key);
  ResidentTile slots;  // the tile's, with what it lacks
  if (known != tiles_.end()) {
    slots.colour = known->second.colour;
    slots.effects = known->second.effects;
    slots.overlay = known->second.overlay;
    slots.normals = known->second.normals;
  }
  const std::array wanted{std::pair(&ResidentTile::colour, true), std::pair(&ResidentTile::effects, !imagery.effects.empty()),
                          std::pair(&ResidentTile::overlay, !imagery.overlays.empty()), std::pair(&ResidentTile::normals, !imagery.normals.empty())};
  std::vector<std::optional<Slot>*> fresh;
  for (const auto& [slot, is_wanted] : wanted) {
    if (!is_wanted || slots.*slot) continue;
    slots.*slot = acquire_colour(thread);
    if (!(slots.*slot)) {
      for (std::optional<Slot>* one : fresh) release_colour(*one);
      return {ErrorCode::exhausted, "the GPU budget has no room for the colours of tile " + geo::to_string(key)};
    }
    fresh.push_back(&(slots.*slot));
  }
  const bool is_new = known == tiles_.end() || !known->second.colour;
  ResidentTile& tile = tiles_[key];
  if (fades && !is_new && !tile.colour_before) {
    if (const auto other = colours_.acquire(thread, budget_)) {
      tile.colour_before = slots.colour;
      tile.renewal = 0;
      if (std::ranges::find(renewed_, key) == renewed_.end()) renewed_.push_back(key);
      slots.colour = other;
    }
  }
  for (const auto& [slot, is_wanted] : wanted) {
    if (!is_wanted) release_colour(slots.*slot);
    tile.*slot = slots.*slot;
  }
  const auto has = [&](surface::ImageUse use) { return std::ranges::find(imagery.effects, use, &surface::ImagePatch::use) != imagery.effects.end(); };
  tile.has_night = has(surface::ImageUse::night);
  tile.has_water = has(surface::ImageUse::water);
  tile.normals_spacing = imagery.normals_spacing;
  bytes_uploaded_ += imagery.bytes();
  auto composed = compositor_.compose(thread, imagery.patches, colours_, *tile.colour, budget_);
  if (composed && tile.effects) composed = compositor_.compose_effects(thread, imagery.effects, colours_, *tile.effects, budget_);
  if (composed && tile.overlay) composed = compositor_.compose(thread, imagery.overlays, colours_, *tile.overlay, budget_);
  if (composed && tile.normals) composed = compositor_.compose(thread, imagery.normals, colours_, *tile.normals, budget_);
  if (!composed) release(key, surface::Part::colour);
  return composed;
}

void TileStore::advance_renewals(float share) {
  std::erase_if(renewed_, [&](const geo::TileKey& key) {
    const auto found = tiles_.find(key);
    if (found == tiles_.end() || !found->second.colour_before) return true;
    ResidentTile& tile = found->second;
    tile.renewal += share;
    if (tile.renewal < 1) return false;
    release_colour(tile.colour_before);
    return true;
  });
}

void TileStore::release(const geo::TileKey& key, surface::Part part) {
  const auto found = tiles_.find(key);
  if (found == tiles_.end()) return;
  ResidentTile& tile = found->second;
  if (part == surface::Part::geometry) {
    tile.mesh.reset();
    if (tile.slopes) slopes_.release(*tile.slopes);
    tile.slopes.reset();
  } else {
    for (auto* slot : {&tile.colour, &tile.colour_before, &tile.effects, &tile.overlay, &tile.normals}) release_colour(*slot);
  }
  if (!tile.mesh && !tile.colour) tiles_.erase(found);
}

const ResidentTile* TileStore::find(const geo::TileKey& key) const {
  const auto found = tiles_.find(key);
  return found == tiles_.end() ? nullptr : &found->second;
}

TileStore::Layer TileStore::colour_of(const ResidentTile* tile) const {
  if (!tile || !tile->colour) return {no_colour_.name(), 0};
  return layer_of(*tile->colour);
}

TileStore::Layer TileStore::colour_before_of(const ResidentTile& tile) const {
  return layer_of(*tile.colour_before);
}

TileStore::Layer TileStore::slopes_of(const ResidentTile* tile) const {
  if (!tile || !tile->slopes) return {no_slope_.name(), 0};
  return {slopes_.texture(*tile->slopes), static_cast<float>(tile->slopes->layer)};
}

}  // namespace tellurion::render
