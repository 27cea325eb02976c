#include "globe/slot_ages.h"

#include <algorithm>
#include <iterator>

namespace tellurion::globe {
namespace {

constexpr std::uint64_t kFramesWanted = 3;  ///< a slot out of sight for longer is not waited for

using Layers = std::vector<surface::Layer>;

bool shows_the_same(const surface::Layer& a, const surface::Layer& b) {
  return a.source_id == b.source_id && a.content == b.content && a.source == b.source && !a.catalogue == !b.catalogue && a.opacity == b.opacity && a.gamma == b.gamma &&
         a.multiplier == b.multiplier && a.feather == b.feather && a.adds == b.adds;
}

/// Where `some` show what `others` do not; both outlive the answer.
void add_differing(const Layers& some, const Layers& others, std::vector<const source::Coverage*>& found) {
  for (const surface::Layer& layer : some) {
    if (std::ranges::none_of(others, [&](const surface::Layer& other) { return shows_the_same(layer, other); })) found.push_back(&surface::coverage_of(layer));
  }
}

/// Where layers that both have lie in another order.
void add_reordered(const Layers& before, const Layers& now, std::vector<const source::Coverage*>& found) {
  const auto common = [](const Layers& some, const Layers& others) {
    std::vector<const surface::Layer*> layers;
    for (const surface::Layer& layer : some) {
      if (std::ranges::find(others, layer.source_id, &surface::Layer::source_id) != others.end()) layers.push_back(&layer);
    }
    return layers;
  };
  const auto old_ones = common(before, now), new_ones = common(now, before);
  for (std::size_t i = 0; i < std::min(old_ones.size(), new_ones.size()); ++i) {
    if (old_ones[i]->source_id != new_ones[i]->source_id) found.push_back(&surface::coverage_of(*new_ones[i]));
  }
}

/// The data sets that a catalogue has gained or lost.
source::Catalogue::Sets changed_sets(const Layers& before, const Layers& now) {
  source::Catalogue::Sets changed;
  for (const surface::Layer& layer : now) {
    const auto old = std::ranges::find(before, layer.source_id, &surface::Layer::source_id);
    if (!layer.catalogue || old == before.end() || !old->catalogue || old->catalogue == layer.catalogue) continue;
    std::ranges::move(source::difference(*old->catalogue, *layer.catalogue), std::back_inserter(changed));
  }
  return changed;
}

}  // namespace

void SlotAges::put(const geo::TileKey& key, Slot slot) {
  released(key);
  if (slot.stale) ++stale_count_;
  slots_.emplace(key, std::move(slot));
}

void SlotAges::released(const geo::TileKey& key) {
  const auto found = slots_.find(key);
  if (found == slots_.end()) return;
  if (found->second.stale) --stale_count_;
  slots_.erase(found);
}

void SlotAges::layers_changed(const surface::SurfaceDescription& before, const surface::SurfaceDescription& now) {
  const Layers& old_layers = part_ == surface::Part::colour ? before.colours : before.heights;
  const Layers& new_layers = part_ == surface::Part::colour ? now.colours : now.heights;
  std::vector<const source::Coverage*> changed;
  add_differing(old_layers, new_layers, changed);
  add_differing(new_layers, old_layers, changed);
  add_reordered(old_layers, new_layers, changed);
  const source::Catalogue::Sets sets = changed_sets(old_layers, new_layers);
  for (const auto& set : sets) changed.push_back(&set->footprint);
  for (auto& [key, slot] : slots_) {
    if (std::ranges::any_of(changed, [&](const source::Coverage* coverage) { return coverage->touches(key); })) {
      if (!slot.stale) ++stale_count_;
      slot.stale = true;
    }
    slot.retry_at = {};
  }
}

bool SlotAges::may_lack(const geo::TileKey& key, const std::vector<std::uint32_t>& missing) const {
  if (const auto own = slots_.find(key); own != slots_.end())
    return own->second.missing.size() > missing.size() && std::ranges::includes(own->second.missing, missing);
  for (int level = key.level; level-- > 0;) {
    const auto above = slots_.find(geo::ancestor(key, level));
    if (above != slots_.end()) return std::ranges::includes(above->second.missing, missing);
  }
  return true;
}

SlotAges::Stale SlotAges::find(std::span<const surface::DrawTile> drawn, TimePoint now) {
  ++frame_;
  Stale stale;
  if (stale_count_ == 0) return stale;
  for (const surface::DrawTile& tile : drawn) {
    if (part_ == surface::Part::colour) {
      find(tile.colour_owner, now, stale);
      find(tile.colour_before, now, stale);
    } else {
      for (int level = tile.key.level; level > 0; --level) find(geo::ancestor(tile.key, level), now, stale);
    }
  }
  return stale;
}

void SlotAges::find(const geo::TileKey& key, TimePoint now, Stale& stale) {
  const auto found = slots_.find(key);
  if (found == slots_.end() || !found->second.stale) return;
  Slot& slot = found->second;
  stale.any = true;
  stale.may_change = stale.may_change || slot.retry_at != TimePoint::max();
  if (slot.shown == frame_) return;
  slot.shown = frame_;
  if (!slot.asked && slot.retry_at <= now) stale.to_ask.push_back(key);
}

void SlotAges::failed(const geo::TileKey& key, TimePoint retry_at) {
  const auto found = slots_.find(key);
  if (found == slots_.end()) return;
  found->second.asked = false;
  found->second.retry_at = retry_at;
}

bool SlotAges::is_wanted(const geo::TileKey& key) const {
  const auto found = slots_.find(key);
  return found != slots_.end() && found->second.stale && found->second.shown > 0 && found->second.shown + kFramesWanted > frame_;
}

void SlotAges::set_asked(const geo::TileKey& key, bool on) {
  if (const auto found = slots_.find(key); found != slots_.end()) found->second.asked = on;
}

}  // namespace tellurion::globe
