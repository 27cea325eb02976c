// Which tiles' colour slots, or geometry, show what their layers held before a time step or a catalogue changed, and are to be made
// anew. Below a slot is either. Lives on the render thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "geo/tile_key.h"
#include "surface/draw_list.h"
#include "surface/elevation_model.h"
#include "surface/tile_tree.h"

namespace tellurion::globe {

class SlotAges {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit SlotAges(surface::Part part) : part_(part) {}

  /// Whether the slot is made anew as this tells; the geometry of roots never is.
  bool holds(const geo::TileKey& key) const { return slots_.contains(key) && (part_ == surface::Part::colour || key.level > 0); }
  /// A slot was composed; `current`: of the layers as they are now.
  void composed(const geo::TileKey& key, bool current) { put(key, Slot{.stale = !current}); }
  /// The same without these layers (numbers of their sources, ascending): old from the start, and asked for again at `retry_at`.
  void composed_without(const geo::TileKey& key, std::vector<std::uint32_t> missing, TimePoint retry_at) {
    put(key, Slot{true, false, 0, retry_at, std::move(missing)});
  }
  /// Whether the slot is better composed without these layers than left as it is: what is shown there now has no more.
  bool may_lack(const geo::TileKey& key, const std::vector<std::uint32_t>& missing) const;
  void released(const geo::TileKey& key);

  /// Slots that a layer touches whose source has changed show old data from now on.
  void layers_changed(const surface::SurfaceDescription& before, const surface::SurfaceDescription& now);

  struct Stale {
    std::vector<geo::TileKey> to_ask;  ///< not asked for yet, or to be asked for again
    bool any = false;                  ///< the drawn tiles show some old slot
    bool may_change = false;           ///< of which some have not failed for good
  };
  /// Of the slots that `drawn` shows; of geometry of those above them too, for the choice of tiles rests on what they tell. Call once
  /// a frame.
  Stale find(std::span<const surface::DrawTile> drawn, TimePoint now);

  void asked(const geo::TileKey& key) { set_asked(key, true); }
  void not_asked(const geo::TileKey& key) { set_asked(key, false); }
  void failed(const geo::TileKey& key, TimePoint retry_at);
  /// Whether the slot is old and one of the last frames showed it.
  bool is_wanted(const geo::TileKey& key) const;

 private:
  struct Slot {
    bool stale = false;
    bool asked = false;
    std::uint64_t shown = 0;  ///< frame that showed it stale last
    TimePoint retry_at{};
    std::vector<std::uint32_t> missing{};  ///< layers that it was composed without
  };
  void put(const geo::TileKey& key, Slot slot);
  void set_asked(const geo::TileKey& key, bool on);
  void find(const geo::TileKey& key, TimePoint now, Stale& stale);

  surface::Part part_;
  std::map<geo::TileKey, Slot> slots_;
  std::size_t stale_count_ = 0;   ///< of them; mostly 0, and then a frame has nothing to look for
  std::uint64_t frame_ = 0;
};

}  // namespace tellurion::globe
