// The tiles that are on the GPU: meshes, slopes and colour slots, within a budget of bytes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>

#include "base/result.h"
#include "geo/tile_key.h"
#include "render/compositor.h"
#include "render/resident_mesh.h"
#include "render/slot_pool.h"
#include "surface/tile_content.h"
#include "surface/tile_tree.h"

namespace tellurion::render {

struct ResidentTile {
  std::unique_ptr<ResidentMesh> mesh;
  std::optional<Slot> slopes;
  glm::dvec3 tangent{1.0, 0.0, 0.0};  ///< of the slopes
  std::optional<Slot> colour;
  std::optional<Slot> colour_before;  ///< what `colour` replaces, until it has faded in
  float renewal = 1.0f;               ///< share of `colour` over it
  std::optional<Slot> effects;        ///< light by night (red, green, blue) and share of water (alpha), where `colour` is
  std::optional<Slot> overlay;        ///< what lies over light and air, likewise
  std::optional<Slot> normals;        ///< likewise
  float normals_spacing = 0;          ///< metres between the finest of them
  bool has_night = false;             ///< the one of the effects is not dark all over
  bool has_water = false;
};

class TileStore {
 public:
  TileStore(gpu::RenderThread& thread, std::size_t budget_bytes, Compositor compositor);

  TileStore(const TileStore&) = delete;  // meshes hold on to the budget
  TileStore& operator=(const TileStore&) = delete;

  /// Composes once with every variant, so that later uploads do not stall. Errors: internal.
  Result<void> warm_up(gpu::RenderThread& thread);

  /// Errors: exhausted. A part that is there already is replaced.
  Result<void> upload_geometry(gpu::RenderThread& thread, const geo::TileKey& key, const surface::TileGeometry& geometry);
  /// `fades`: over what was there, if there is room for both, as advance_renewals goes on.
  Result<void> upload_colour(gpu::RenderThread& thread, const geo::TileKey& key, const surface::TileImagery& imagery, bool fades = false);
  /// Goes on with all that fades, by this share of the whole.
  void advance_renewals(float share);
  void release(const geo::TileKey& key, surface::Part part);

  /// Nothing if no part of the tile is there.
  const ResidentTile* find(const geo::TileKey& key) const;

  /// A texture array and a layer in it.
  struct Layer {
    unsigned texture = 0;
    float layer = 0;
  };
  /// The slot of `tile`, or an empty one (transparent; flat) if it has none.
  Layer colour_of(const ResidentTile* tile) const;
  Layer colour_before_of(const ResidentTile& tile) const;
  /// Of a tile that has such a slot.
  Layer effects_of(const ResidentTile& tile) const { return layer_of(*tile.effects); }
  Layer overlay_of(const ResidentTile& tile) const { return layer_of(*tile.overlay); }
  Layer normals_of(const ResidentTile& tile) const { return layer_of(*tile.normals); }
  Layer slopes_of(const ResidentTile* tile) const;

  Budget& budget() { return budget_; }
  const Budget& budget() const { return budget_; }
  std::uint64_t bytes_uploaded() const { return bytes_uploaded_; }
  std::size_t colour_slots_free() const { return colours_.free_slots(budget_); }

 private:
  Layer layer_of(Slot colour) const { return {colours_.texture(colour), static_cast<float>(colour.layer)}; }
  /// Slot arrays that nothing uses give way.
  bool has_room(gpu::RenderThread& thread, std::size_t bytes);
  std::optional<Slot> acquire_colour(gpu::RenderThread& thread);
  void release_colour(std::optional<Slot>& slot);
  void upload_slopes(Slot slot, const surface::SlopeMap& map);

  Budget budget_;
  Compositor compositor_;
  SlotPool colours_;
  SlotPool slopes_;
  gpu::Texture no_colour_;
  gpu::Texture no_slope_;
  std::unordered_map<geo::TileKey, ResidentTile> tiles_;
  std::vector<glm::vec2> slope_level_;
  std::vector<geo::TileKey> renewed_;  ///< that have a colour_before
  std::uint64_t bytes_uploaded_ = 0;
};

}  // namespace tellurion::render
