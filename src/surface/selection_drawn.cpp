#include "surface/selection_drawn.h"

#include <algorithm>
#include <utility>

namespace tellurion::surface {
namespace {

constexpr int kFinerLevels = 3;       ///< how far below a missing tile finer ones are looked for
constexpr double kSkirtPixels = 2;

constexpr double kBelowEye = 0.01;    ///< of how far a tile may sink: how far below the eye its highest points are then

/// What a tile's heights deviate by at most while it also shows its parent's.
double height_error(const Node& node) {
  if (node.morph >= 1 || node.is_root()) return node.shown_bound_m;
  const Node& parent = *node.parent;
  return std::max(node.shown_bound_m, parent.error_known ? parent.bound_m : 4 * node.shown_bound_m);
}

/// How far the skirt of a neighbour may have to reach: the same, and what it may be drawn lower by. Where the error is only foretold, finer
/// tiles may find more: nothing but the range of its heights is sure.
double shown_error(const SelectionFrame& frame, const Node& node) {
  double error = height_error(node);
  if (node.facts.assumed && node.built) {
    const TileMetrics& metrics = node.built->metrics;
    error = std::max(error, frame.settings.exaggeration * static_cast<double>(metrics.max_height - metrics.min_height));
  }
  return error + node.sink_m;
}

bool shows_colour(const Node& node) { return node.is_root() || node.resident(Part::colour) != nullptr; }

}  // namespace

void DrawnCut::find(const SelectionFrame& frame, std::vector<DrawTile>& tiles, SelectionStats& stats) {
  nodes_.clear();
  in_transition_ = false;
  for (Node& root : pool_.roots()) draw(frame, root);
  std::ranges::sort(nodes_, [](const Node* a, const Node* b) {
    return a->distance != b->distance ? a->distance < b->distance : a->key < b->key;
  });
  for (Node* node : nodes_) {
    advance(frame, *node);
    wanted_.choose_step(frame, *node);
    // Nearer than its error the true surface may be below the eye and the drawn one above it.
    const double error = height_error(*node);
    node->sink_m = node->distance < error ? error : 0;
    mark_border(frame, *node);
  }
  tiles.clear();
  stats.drawn_by_level.clear();
  stats.max_error_px = 0;
  for (Node* node : nodes_) {
    const DrawTile& tile = tiles.emplace_back(tile_of(frame, *node));
    const std::size_t level = node->key.level;
    if (stats.drawn_by_level.size() <= level) stats.drawn_by_level.resize(level + 1, 0);
    ++stats.drawn_by_level[level];
    stats.max_error_px = std::max<double>(stats.max_error_px, tile.error_px);
  }
  stats.tiles_drawn = static_cast<int>(tiles.size());
}

void DrawnCut::lay_floor(const SelectionFrame& frame, std::vector<DrawTile>& floor) const {
  floor.clear();
  for (const Node& root : pool_.roots()) {
    const Resident* geometry = root.resident(Part::geometry);
    if (!root.visible || geometry == nullptr) continue;
    DrawTile& tile = floor.emplace_back(DrawTile{.key = root.key, .colour_owner = root.key, .colour_before = root.key, .slope_owner = root.key});
    const TileMetrics& built = geometry->metrics;
    tile.step = static_cast<std::uint8_t>(built.step_count - 1);
    tile.skirt_depth = 2 * built.steps[tile.step].curvature;
    tile.distance = root.distance;
    tile.sink_level = static_cast<float>(frame.lowest);
    tile.sink_depth = static_cast<float>(frame.settings.exaggeration * static_cast<double>(built.max_height) - frame.lowest);
  }
}

bool DrawnCut::draw(const SelectionFrame& frame, Node& node) {
  if (!node.visible) return true;
  if (node.split && draw_children(frame, node)) return true;
  if (node.resident(Part::geometry) != nullptr) {
    if (node.split || !draw_merging(frame, node)) nodes_.push_back(&node);
    return true;
  }
  return !node.split && draw_finer(frame, node, kFinerLevels);
}

bool DrawnCut::draw_children(const SelectionFrame& frame, Node& node) {
  const std::size_t before = nodes_.size();
  for (int i = 0; i < 4; ++i) {
    if (draw(frame, node.children[i])) continue;
    nodes_.resize(before);
    return false;
  }
  return true;
}

bool DrawnCut::draw_finer(const SelectionFrame& frame, Node& node, int levels) {
  if (levels == 0 || node.children == nullptr) return false;
  const std::size_t before = nodes_.size();
  for (int i = 0; i < 4; ++i) {
    Node& child = node.children[i];
    wanted_.see(frame, child);
    if (!child.visible) continue;
    if (child.resident(Part::geometry) != nullptr) {
      nodes_.push_back(&child);
    } else if (!draw_finer(frame, child, levels - 1)) {
      nodes_.resize(before);
      return false;
    }
  }
  return true;
}

/// Keeps children that were drawn until they look like their parent. False: draw the parent.
bool DrawnCut::draw_merging(const SelectionFrame& frame, Node& node) {
  if (!frame.settings.transitions || node.children == nullptr || frame.was_drawn(node)) return false;
  const std::size_t before = nodes_.size();
  bool still_differs = false;
  for (int i = 0; i < 4; ++i) {
    Node& child = node.children[i];
    wanted_.see(frame, child);
    if (!child.visible) continue;
    if (child.resident(Part::geometry) == nullptr || !frame.was_drawn(child)) {
      still_differs = false;
      break;
    }
    child.merging = frame.number;
    still_differs = still_differs || child.morph > 0 || child.fade < 1 || child.colour_to != node.colour_shown;
    nodes_.push_back(&child);
  }
  if (!still_differs) nodes_.resize(before);
  return still_differs;
}

/// Moves fade and morph on.
void DrawnCut::advance(const SelectionFrame& frame, Node& node) {
  const bool merges = node.merging == frame.number;
  Node* const colour = merges ? node.parent->colour_shown : node.colour_shown;
  const float morph = merges ? 0.0f : 1.0f;
  const float step = frame.transition_step;
  if (!frame.settings.transitions) {
    node.colour_from = node.colour_to = colour;
    node.fade = node.morph = 1;
  } else if (frame.was_drawn(node)) {
    node.morph = node.morph < morph ? std::min(morph, node.morph + step) : std::max(morph, node.morph - step);
    if (colour != node.colour_to) {
      if (colour == node.colour_from) {
        node.fade = 1 - node.fade;
      } else {
        node.fade = 0;
      }
      node.colour_from = std::exchange(node.colour_to, colour);
    }
    node.fade = std::min(1.0f, node.fade + step);
  } else {
    Node* before = node.parent;
    while (before != nullptr && !frame.was_drawn(*before)) before = before->parent;
    node.colour_to = colour;
    node.colour_from = before != nullptr ? before->colour_to : colour;
    node.fade = node.colour_from != colour ? 0.0f : 1.0f;
    node.morph = before != nullptr ? 0.0f : morph;
  }
  if (!shows_colour(*node.colour_from) || node.colour_from == node.colour_to) node.fade = 1;
  if (node.fade >= 1) node.colour_from = node.colour_to;
  in_transition_ = in_transition_ || node.fade < 1 || node.morph < 1;
  node.drawn = frame.number;
  if (node.merging == frame.number || !node.parent || !node.parent->split) {
    for (UseOrder& order : orders_) order.touch_path(node, frame.number);  // the wanted cut did not visit it
  }
}

/// Tells the ancestors what is drawn below them, for border_error.
void DrawnCut::mark_border(const SelectionFrame& frame, Node& node) {
  const double error = shown_error(frame, node);
  for (Node* n = &node; n != nullptr; n = n->parent) {
    if (n->bordered == frame.number && n->border_error_m >= error) return;
    n->border_error_m = n->bordered == frame.number ? std::max(n->border_error_m, error) : error;
    n->bordered = frame.number;
  }
}

/// Largest error drawn beyond `side`: of the tile there of the same size or larger, or the largest of those within an area
/// of the node's own size (a safe bound of those along the border). 0 where nothing is drawn.
double DrawnCut::border_error(const SelectionFrame& frame, const Node& node, geo::Side side) {
  const geo::TileKey beyond = geo::neighbour(node.key, side);
  Node* common = node.parent;
  while (common != nullptr && !geo::contains(common->key, beyond)) common = common->parent;
  const Node* found = common != nullptr ? pool_.nearest(*common, beyond) : pool_.nearest(beyond);
  if (found->key == beyond && found->bordered == frame.number) return found->border_error_m;
  while (found != nullptr && found->drawn != frame.number) found = found->parent;
  return found != nullptr ? found->border_error_m : 0;
}

DrawTile DrawnCut::tile_of(const SelectionFrame& frame, Node& node) {
  double beyond = 0;
  for (const geo::Side side : {geo::Side::north, geo::Side::east, geo::Side::south, geo::Side::west}) {
    beyond = std::max(beyond, border_error(frame, node, side));
  }
  const double distance = std::max(node.distance, kNearestDistance);
  const double skirt = shown_error(frame, node) + beyond + kSkirtPixels * frame.errors.pixel_angle * distance;

  // A slot of an ancestor shows larger texels than the tile's own; that counts unless there is nothing finer to show.
  double error_px = std::max(node.error_px, node.shown_px);
  if (node.colour_to != node.colour_owner) {
    const double texel = texel_metres(node.colour_to->shape);
    error_px = std::max(error_px, to_pixels(frame.errors, texel, node.distance) * node.texel_share);
  }
  DrawTile tile;
  tile.key = node.key;
  tile.colour_owner = node.colour_to->key;
  tile.colour_before = node.colour_from->key;
  tile.slope_owner = node.slope_shown->key;
  tile.fade = node.fade;
  tile.morph = node.morph;
  tile.skirt_depth = static_cast<float>(skirt);
  tile.error_px = static_cast<float>(error_px);
  tile.distance = node.distance;
  tile.step = node.step;
  tile.sink_depth = static_cast<float>(node.sink_m);
  tile.sink_level = static_cast<float>(frame.eye_height - kBelowEye * node.sink_m);
  return tile;
}

}  // namespace tellurion::surface
