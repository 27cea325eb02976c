#include "surface/tile_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <span>
#include <utility>

#include "surface/selection_drawn.h"
#include "surface/selection_requests.h"
#include "surface/selection_wanted.h"

namespace tellurion::surface {
struct TileTree::State {
  State(const geo::Ellipsoid& ellipsoid, std::shared_ptr<const SurfaceFacts> facts) : pool(ellipsoid, std::move(facts)) {
    selection.stats.selected_by_level.reserve(geo::kMaxTileLevel + 1);
    selection.stats.drawn_by_level.reserve(geo::kMaxTileLevel + 1);
  }

  NodePool pool;
  std::array<UseOrder, kPartCount> orders{UseOrder(Part::geometry), UseOrder(Part::colour)};
  WantedCut wanted{pool, orders};
  DrawnCut drawn{pool, wanted, orders};
  RequestList requests{pool};
  Selection selection;
  WantedCut ahead{pool, orders};
  Selection foreseen;
  FrameNumber frame = 1;  // node stamps start at 0: no node counts as drawn in the frame before the first
  FrameNumber drawn_frame = 1;
  TimePoint last_time;

  bool has_selected() const { return frame > 1; }

  void happens(Node& node, Part part, const PartEvent& event) {
    PartLife& life = node.part(part).life;
    UseOrder& order = orders[index_of(part)];
    const bool was_resident = std::holds_alternative<Resident>(life);
    life = next_life(life, event);
    const bool is_resident = std::holds_alternative<Resident>(life);
    if (was_resident && !is_resident) order.remove(node);
    if (!was_resident && is_resident) order.touch_path(node, frame);
  }
};

TileTree::TileTree(const geo::Ellipsoid& ellipsoid, std::shared_ptr<const SurfaceFacts> facts)
    : state_(std::make_unique<State>(ellipsoid, std::move(facts))) {}

TileTree::~TileTree() = default;

void TileTree::set_facts(std::shared_ptr<const SurfaceFacts> facts) { state_->pool.set_facts(std::move(facts)); }

const Selection& TileTree::select(const view::Camera& camera, const SelectionSettings& settings,
                                  std::chrono::steady_clock::time_point now) {
  State& s = *state_;
  if (settings.frozen && s.has_selected()) {
    s.selection.requests.clear();
    return s.selection;
  }
  assert(std::ranges::all_of(s.pool.roots(), [](const Node& root) { return root.resident(Part::geometry) != nullptr; }));

  ++s.frame;
  SelectionFrame frame = make_frame(s.pool, camera, settings, s.frame, s.drawn_frame, now);
  s.drawn_frame = s.frame;
  const std::chrono::duration<float> elapsed = s.last_time != TimePoint{} ? now - s.last_time : std::chrono::steady_clock::duration{};
  frame.transition_step = std::clamp(elapsed / kTransitionTime, 0.0f, 1.0f);
  s.last_time = now;

  SelectionStats& stats = s.selection.stats;
  s.wanted.find(frame);
  stats.tiles_visited = s.wanted.tiles_visited();
  stats.tiles_selected = s.wanted.tiles_selected();
  stats.effective_sse_px = s.wanted.effective_sse_px();
  s.drawn.find(frame, s.selection.draw, stats);
  s.requests.find(frame, s.selection.requests, stats);
  stats.complete = stats.tiles_waiting == 0 && stats.tiles_drawn == stats.tiles_selected && !s.drawn.in_transition();
  s.selection.floor.clear();
  if (!stats.complete) s.drawn.lay_floor(frame, s.selection.floor);
  s.pool.prune(s.frame, now);
  return s.selection;
}

std::span<const TileRequest> TileTree::foresee(const view::Camera& camera, const SelectionSettings& settings,
                                               std::chrono::steady_clock::time_point now) {
  State& s = *state_;
  s.foreseen.requests.clear();
  if (settings.frozen || !s.has_selected()) return {};
  ++s.frame;  // one of its own, in which nothing is drawn
  const SelectionFrame frame = make_frame(s.pool, camera, settings, s.frame, s.drawn_frame, now);
  s.ahead.find(frame);
  s.requests.find(frame, s.foreseen.requests, s.foreseen.stats);
  return s.foreseen.requests;
}

void TileTree::started(const geo::TileKey& key, Part part) { state_->happens(state_->pool.at(key), part, Start{}); }

void TileTree::cancelled(const geo::TileKey& key, Part part) { state_->happens(state_->pool.at(key), part, Cancel{}); }

void TileTree::arrived_geometry(const geo::TileKey& key, const TileMetrics& metrics, bool has_slopes) {
  Node& node = state_->pool.at(key);
  node.built = Resident{metrics, has_slopes};
  state_->happens(node, Part::geometry, Arrive{*node.built});
}

void TileTree::arrived_colour(const geo::TileKey& key) {
  state_->happens(state_->pool.at(key), Part::colour, Arrive{});
}

void TileTree::failed(const geo::TileKey& key, Part part, std::chrono::steady_clock::time_point retry_at) {
  state_->happens(state_->pool.at(key), part, Fail{retry_at});
}

void TileTree::released(const geo::TileKey& key, Part part) {
  state_->happens(state_->pool.at(key), part, Release{});
}

void TileTree::forget_failures(Part part) { state_->pool.forget_failures(part); }

bool TileTree::is_wanted(const geo::TileKey& key, Part part) const {
  const Node* node = state_->pool.find(key);
  return node != nullptr && node->part(part).wanted + kFramesWanted > state_->frame && node->part(part).wanted > 0;
}

double TileTree::gain_px(const geo::TileKey& key, Part part) const {
  const Node* node = state_->pool.find(key);
  return node != nullptr ? node->part(part).gain_px : 0;
}

std::optional<geo::TileKey> TileTree::eviction_candidate(Part part) const {
  const Node* node = state_->orders[index_of(part)].oldest();
  if (node == nullptr || node->part(part).used == state_->frame) return std::nullopt;
  return node->key;
}

}  // namespace tellurion::surface
