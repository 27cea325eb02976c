#include "surface/selection_requests.h"

#include <algorithm>
#include <chrono>
#include <tuple>

namespace tellurion::surface {
namespace {

/// Texels of a tile that finer ones will cover are worth their bytes if they are not much coarser than the picture on the way to
/// them, nor nearly as fine: one step of kOutlookLevels for most tiles. And only where what will cover them lets itself wait.
constexpr double kFinestStepPixels = 8, kCoarsestStepPixels = 64;
constexpr std::chrono::seconds kPatience{2};

/// Called in each frame in which finer tiles are to cover the node's colours and do not yet.
bool is_worth_a_step(const SelectionFrame& frame, Node& node) {
  if (node.awaited != frame.last) node.awaited_since = frame.now;
  node.awaited = frame.number;
  const double px = to_pixels(frame.errors, texel_metres(node.shape), node.distance) * node.texel_share / frame.settings.sse_px;
  return px >= kFinestStepPixels && px < kCoarsestStepPixels && frame.now - node.awaited_since >= kPatience;
}

}  // namespace

void RequestList::find(const SelectionFrame& frame, std::vector<TileRequest>& requests, SelectionStats& stats) {
  requests_.clear();
  stats.tiles_waiting = 0;
  retries_later_ = false;
  stats.selected_by_level.clear();
  for (Node& root : pool_.roots()) collect(frame, root, {}, stats);
  stats.retries_later = retries_later_;
  const auto order = [](const TileRequest& a, const TileRequest& b) {
    return std::tie(b.gain_px, a.key, a.part) < std::tie(a.gain_px, b.key, b.part);
  };
  const std::size_t count = std::min(requests_.size(), kMostRequests);
  const auto end = requests_.begin() + static_cast<std::ptrdiff_t>(count);
  std::ranges::partial_sort(requests_, end, order);
  requests.assign(requests_.begin(), end);
}

void RequestList::want(const SelectionFrame& frame, Node& node, Part part, double gain_px) {
  NodePart& wanted = node.part(part);
  wanted.gain_px = wanted.wanted == frame.number ? std::max(wanted.gain_px, gain_px) : std::max(gain_px, 0.0);
  wanted.wanted = frame.number;
  if (const auto* failed = std::get_if<Failed>(&wanted.life)) retries_later_ = retries_later_ || failed->retry_at != TimePoint::max();
  if (!can_request(wanted.life, frame.now)) return;
  const std::size_t p = index_of(part);
  if (node.requested[p] == frame.number) {
    double& gain = requests_[node.request_index[p]].gain_px;
    gain = std::max(gain, gain_px);
    return;
  }
  node.requested[p] = frame.number;
  node.request_index[p] = static_cast<std::uint32_t>(requests_.size());
  requests_.push_back({node.key, part, std::max(gain_px, 0.0)});
}

/// Asks for the slot of the node's colour owner; true if it is resident already.
bool RequestList::want_colour(const SelectionFrame& frame, Node& node) {
  Node& owner = *node.colour_owner;
  if (owner.resident(Part::colour) != nullptr) return true;
  const Node& shown = *node.colour_shown;  // a slot that is not there shows one colour for all of its tile
  const double texel = shown.resident(Part::colour) != nullptr ? texel_metres(shown.shape) : shown.shape.size;
  const double lost = texel - texel_metres(owner.shape);
  want(frame, owner, Part::colour, to_pixels(frame.errors, lost, node.distance) * node.texel_share);
  return false;
}

void RequestList::collect(const SelectionFrame& frame, Node& node, StandIn shown, SelectionStats& stats) {
  if (!node.visible) return;
  const bool has_geometry = node.resident(Part::geometry) != nullptr;
  if (node.drawn == frame.number) shown = {&node, to_pixels(frame.errors, node.error_m, node.distance)};
  else if (has_geometry) shown.held_up_px = 0;
  // Errors of a stand-in are taken where the node is. Without one, finer tiles are drawn: nothing is lost by waiting.
  const double shown_px = shown.node != nullptr ? std::max(to_pixels(frame.errors, shown.node->error_m, node.distance), shown.held_up_px) : 0;
  if (node.split) {
    const bool is_step = shown.node != nullptr && node.key.level % kOutlookLevels == 0;
    if (is_step && !has_geometry) want(frame, node, Part::geometry, shown_px);
    if (is_step && is_worth_a_step(frame, node)) want_colour(frame, node);
    if (is_step && shown.node != &node) shown.held_up_px = 0;
    for (int i = 0; i < 4; ++i) collect(frame, node.children[i], shown, stats);
    return;
  }

  const std::size_t level = node.key.level;
  if (stats.selected_by_level.size() <= level) stats.selected_by_level.resize(level + 1, 0);
  ++stats.selected_by_level[level];

  if (!has_geometry) want(frame, node, Part::geometry, shown_px - node.geometry_px);
  Node& slopes = *node.slope_owner;
  const bool has_slopes = slopes.resident(Part::geometry) != nullptr;
  if (!has_slopes && &slopes != &node) want(frame, slopes, Part::geometry, shown_px - node.geometry_px);

  // One that only waits to learn how it is to be split: finer ones will show the colours.
  const bool is_passed = node.facts.assumed && !has_geometry && !node.colour_suffices && frame.settings.metric == LodMetric::screen_space_error;
  const bool has_colour = is_passed && !is_worth_a_step(frame, node) ? node.colour_owner->resident(Part::colour) != nullptr : want_colour(frame, node);
  if (!has_geometry || !has_slopes || !has_colour) ++stats.tiles_waiting;
}

}  // namespace tellurion::surface
