#include "surface/selection_wanted.h"

#include <algorithm>
#include <cmath>

#include "surface/lowest_in_sight.h"

namespace tellurion::surface {
namespace {

constexpr double kErrorStep = 1.25;
constexpr int kMostErrorSteps = 100;
/// A pass that selects so many times the allowed tiles is broken off: it cannot fit.
constexpr std::size_t kHopelessFactor = 4;
/// The metrics that ignore errors stop where the error is below this share of the wanted one: the data have no more to show.
constexpr double kNothingToGain = 1.0 / 16;

struct HeightRange {
  double lowest = 0;
  double highest = 0;
};

/// Where facts only assume, a tile of every third level is built before anything below it is asked for: its outlook tells what.
/// One that can never be built leaves that to those above it.
bool waits_for_outlook(const Node& node) {
  const auto* failed = std::get_if<Failed>(&node.part(Part::geometry).life);
  return node.facts.assumed && node.key.level % kOutlookLevels == 0 && !(node.built && node.built->metrics.outlook) &&
         !(failed != nullptr && failed->retry_at == TimePoint::max());
}

/// Bounds of the displayed heights: the outlook's, if there is one. Where there is none and facts give no error either, a tile is
/// judged once it has been built, and then by its own range; cut to that before, so that what was culled before it arrived is
/// culled after.
HeightRange heights_of(const Node& node, const Outlook::Block* outlook, double exaggeration) {
  double lowest = outlook != nullptr ? outlook->min_height : node.facts.min_height;
  double highest = outlook != nullptr ? outlook->max_height : node.facts.max_height;
  if (node.built && !node.facts.height_error && outlook == nullptr) {
    const double low = node.built->metrics.min_height, high = node.built->metrics.max_height;
    lowest = std::clamp(low, lowest, highest);
    highest = std::clamp(high, lowest, highest);
  }
  return {lowest * exaggeration, highest * exaggeration};
}

void inherit_owners(Node& node) {
  Node* const parent = node.parent;
  const bool has_colour = node.resident(Part::colour) != nullptr;
  const bool owns_colour = node.facts.own_colour && (parent == nullptr || !parent->colour_suffices);
  node.colour_owner = owns_colour ? &node : parent->colour_owner;
  const bool has_owners = node.colour_owner->resident(Part::colour) != nullptr;
  if (has_owners || parent == nullptr) node.colour_shown = node.colour_owner;
  else node.colour_shown = node.facts.own_colour && has_colour ? &node : parent->colour_shown;

  // An owner that turned out to hold no slopes passes the question on.
  const bool owns_slopes = node.facts.own_slopes && (!node.built || node.built->has_slopes);
  const bool has_slopes = owns_slopes && node.resident(Part::geometry) != nullptr;
  node.slope_owner = parent == nullptr || owns_slopes ? &node : parent->slope_owner;
  node.slope_shown = parent == nullptr || has_slopes ? &node : parent->slope_shown;
}

}  // namespace

std::size_t bytes_of_tile(const TileFacts& facts, std::size_t mesh_bytes) {
  constexpr std::size_t kSlopes = kSlopeSlotSide * kSlopeSlotSide * 4 * 4 / 3;
  constexpr std::size_t kColour = kColourSlotSide * kColourSlotSide * 4 * 4 / 3;
  return mesh_bytes + (facts.own_slopes ? kSlopes : 0) + kColour * (std::size_t{facts.own_colour} + std::size_t{facts.own_effects} + std::size_t{facts.own_overlay} + std::size_t{facts.own_normals});
}

SelectionFrame make_frame(NodePool& pool, const view::Camera& camera, const SelectionSettings& settings,
                          FrameNumber number, FrameNumber last, TimePoint now) {
  double lowest = 0;
  for (const Node& root : pool.roots()) lowest = std::min<double>(lowest, root.facts.min_height);
  lowest *= settings.exaggeration;
  const ErrorView errors{camera.eye.xyz, camera.pixel_angle(), settings.exaggeration, settings.anisotropy,
                         pool.ellipsoid().a()};
  SelectionFrame frame{number, last, now, settings, errors, make_view_volume(camera), Horizon(pool.ellipsoid(), camera.eye.xyz, lowest),
                       geo::to_geodetic(pool.ellipsoid(), camera.eye).height.value, lowest};
  frame.horizon = Horizon(pool.ellipsoid(), camera.eye.xyz, lowest_in_sight(pool, frame));
  return frame;
}

void WantedCut::see(const SelectionFrame& frame, Node& node) const {
  if (node.seen == frame.number) return;
  node.seen = frame.number;
  node.split = false;
  // Never its own outlook, and never its own range where the outlook above tells one: what was built by chance must not matter.
  const Outlook::Block* const outlook = node.facts.assumed ? foretold(node) : nullptr;
  const HeightRange heights = heights_of(node, outlook, frame.settings.exaggeration);
  if (heights.lowest != node.box_lowest || heights.highest != node.box_highest) {
    node.box = tile_box(pool_.ellipsoid(), node.key, heights.lowest, heights.highest);
    node.box_lowest = heights.lowest;
    node.box_highest = heights.highest;
  }
  const auto planes = planes_crossed(frame.volume, node.box, node.is_root() ? kAllPlanes : node.parent->planes);
  node.visible = planes.has_value() && !frame.horizon.hides(node.box);
  if (!node.visible) return;
  node.planes = *planes;
  inherit_owners(node);

  std::optional<HeightError> known = node.facts.height_error;
  double max_height = node.facts.max_height;
  if (known && node.facts.assumed) {
    known.reset();
    if (outlook != nullptr) {
      known = outlook->error;
      max_height = outlook->max_height;
    }
  }
  node.error_known = known || node.built;
  node.error_m = node.bound_m = 0;
  if (known) {
    const DisplayedError full = displayed_error(frame.errors, {*known, node.full_grid_error}, max_height);
    node.error_m = full.judged;
    node.bound_m = full.bound;
  }
  if (node.built) {
    const TileMetrics& built = node.built->metrics;
    const DisplayedError finest = displayed_error(frame.errors, built.steps.front(), built.max_height);
    node.error_m = std::max(node.error_m, finest.judged);
    node.bound_m = std::max(node.bound_m, finest.bound);
  }
  node.distance = distance_to(node.box, frame.errors.eye);
  node.geometry_px = to_pixels(frame.errors, std::max(node.error_m, precision_metres(node.shape)), node.distance);
  node.texel_share = visible_share(frame.errors, node.shape, node.box, heights.highest - heights.lowest);
  node.error_px = node.geometry_px;
  // Tiles that are split for their geometry alone go on showing the colours of the one whose texels were fine enough.
  const double texel_px = to_pixels(frame.errors, texel_metres(node.shape), node.distance) * node.texel_share;
  const bool by_error = frame.settings.metric == LodMetric::screen_space_error;
  node.colour_suffices = !node.facts.finer_colour_below || (by_error && texel_px <= frame.settings.sse_px) ||
                         (node.parent != nullptr && node.parent->colour_suffices);
  if (!node.colour_suffices) node.error_px = std::max(node.error_px, texel_px);
}

void WantedCut::choose_step(const SelectionFrame& frame, Node& node) const {
  node.step = 0;
  node.shown_bound_m = node.bound_m;
  node.shown_px = node.geometry_px;
  const Resident* geometry = node.resident(Part::geometry);
  if (geometry == nullptr || frame.settings.metric != LodMetric::screen_space_error) return;
  const TileMetrics& built = geometry->metrics;
  for (int step = built.step_count - 1; step > 0; --step) {
    const DisplayedError error = displayed_error(frame.errors, built.steps[static_cast<std::size_t>(step)], built.max_height);
    const double px = to_pixels(frame.errors, std::max(error.judged, precision_metres(node.shape)), node.distance);
    if (px > effective_sse_px_) continue;
    node.step = static_cast<std::uint8_t>(step);
    node.shown_bound_m = std::max(node.bound_m, error.bound);
    node.shown_px = std::max(node.geometry_px, px);
    return;
  }
}

bool WantedCut::wants_split(const SelectionFrame& frame, const Node& node) const {
  if (node.key.level == geo::kMaxTileLevel || !node.error_known || waits_for_outlook(node)) return false;
  const bool has_more = node.error_px > kNothingToGain * effective_sse_px_;
  const double distance = std::max(node.distance, kNearestDistance);
  switch (frame.settings.metric) {
    case LodMetric::screen_space_error:
      return node.error_px > effective_sse_px_;
    case LodMetric::distance:
      return has_more && distance < split_distance_ * node.shape.size;
    case LodMetric::solid_angle:
      return has_more && node.shape.size * node.shape.size * node.texel_share > split_solid_angle_ * distance * distance;
  }
  return false;
}

void WantedCut::refine(const SelectionFrame& frame, Node& node) {
  ++visited_;
  see(frame, node);
  if (!node.visible) return;
  node.split = wants_split(frame, node);
  if (!node.split) {
    ++selected_;
    if (node.built) {
      ++selected_built_;
      selected_mesh_bytes_ += node.built->metrics.mesh_bytes;
    }
    selected_bytes_ += bytes_of_tile(node.facts, node.built ? node.built->metrics.mesh_bytes : typical_mesh_bytes_);
  } else if (within(frame.settings, kHopelessFactor)) {
    pool_.add_children(node);
    for (int i = 0; i < 4; ++i) refine(frame, node.children[i]);
  }
}

/// Only what the chosen cut rests on is in use: trials that did not fit must not keep their tiles from being dropped.
void WantedCut::touch(const SelectionFrame& frame, Node& node) const {
  if (!node.visible) return;
  if (node.split && node.children != nullptr) {
    for (int i = 0; i < 4; ++i) touch(frame, node.children[i]);
  }
  for (UseOrder& order : orders_) order.touch(node, frame.number);  // after the children: see UseOrder
}

bool WantedCut::fits(const SelectionFrame& frame, int steps) {
  visited_ = selected_ = 0;
  selected_built_ = selected_bytes_ = selected_mesh_bytes_ = 0;
  effective_sse_px_ = frame.settings.sse_px * std::pow(kErrorStep, steps);
  split_distance_ = split_distance_in_sizes(frame.errors, effective_sse_px_);
  split_solid_angle_ = split_solid_angle(frame.errors, effective_sse_px_);
  for (Node& root : pool_.roots()) refine(frame, root);
  return within(frame.settings, 1);
}

bool WantedCut::within(const SelectionSettings& settings, std::size_t factor) const {
  return static_cast<std::size_t>(selected_) / factor <= settings.max_tiles && selected_bytes_ / factor <= settings.max_bytes;
}

void WantedCut::find(const SelectionFrame& frame) {
  if (!fits(frame, steps_)) {
    while (steps_ < kMostErrorSteps && !fits(frame, ++steps_)) {}
  } else if (steps_ > 0) {
    while (steps_ > 0 && fits(frame, steps_ - 1)) --steps_;
    if (steps_ > 0) fits(frame, steps_);  // the last trial marked the nodes for a cut that does not fit
  }
  for (Node& root : pool_.roots()) touch(frame, root);
  if (selected_built_ > 0) typical_mesh_bytes_ = selected_mesh_bytes_ / selected_built_;
}

}  // namespace tellurion::surface
