#include "surface/selection_node.h"

#include <algorithm>
#include <utility>

namespace tellurion::surface {
namespace {

constexpr FrameNumber kFramesKept = 120;
constexpr std::size_t kQuadsPrunedPerFrame = 32;

}  // namespace

const Outlook::Block* foretold(const Node& node) {
  for (const Node* above = node.parent; above != nullptr; above = above->parent) {
    if (above->key.level % kOutlookLevels == 0 && above->built && above->built->metrics.outlook)
      return &above->built->metrics.outlook->of(above->key, node.key);
  }
  return nullptr;
}

void UseOrder::remove(Node& node) {
  NodePart& part = node.part(part_);
  if (part.older == nullptr && oldest_ != &node) return;  // not listed
  (part.older != nullptr ? part.older->part(part_).newer : oldest_) = part.newer;
  (part.newer != nullptr ? part.newer->part(part_).older : newest_) = part.older;
  part.older = part.newer = nullptr;
}

void UseOrder::touch(Node& node, FrameNumber frame) {
  if (node.is_root() || node.resident(part_) == nullptr) return;
  NodePart& part = node.part(part_);
  part.used = frame;
  if (newest_ == &node) return;
  remove(node);
  part.older = newest_;
  (newest_ != nullptr ? newest_->part(part_).newer : oldest_) = &node;
  newest_ = &node;
}

void UseOrder::touch_path(Node& node, FrameNumber frame) {
  for (Node* n = &node; n != nullptr; n = n->parent) touch(*n, frame);
}

NodePool::NodePool(const geo::Ellipsoid& ellipsoid, std::shared_ptr<const SurfaceFacts> facts)
    : ellipsoid_(ellipsoid), facts_(std::move(facts)) {
  for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) init(roots_[face], {face, 0, 0, 0}, nullptr);
}

void NodePool::init(Node& node, const geo::TileKey& key, Node* parent) const {
  node = Node{};
  node.key = key;
  node.parent = parent;
  node.shape = tile_shape(ellipsoid_, key);
  node.full_grid_error = full_grid_curvature_error(ellipsoid_, node.shape);
  learn(node);
}

void NodePool::learn(Node& node) const {
  node.facts = facts_->facts_of(node.key);
  if (node.is_root()) node.facts.own_colour = node.facts.own_slopes = true;  // someone must own what nobody else does
  node.seen = 0;
}

void NodePool::set_facts(std::shared_ptr<const SurfaceFacts> facts) {
  facts_ = std::move(facts);
  const auto renew = [&](Node& node) {
    learn(node);
    if (node.resident(Part::geometry) == nullptr) node.built.reset();
  };
  for (Node& root : roots_) renew(root);
  for (Quad& quad : quads_) {
    if (!quad.in_use) continue;
    for (Node& node : quad.nodes) renew(node);
  }
}

Node* NodePool::nearest(Node& from, const geo::TileKey& key) {
  Node* node = &from;
  while (node->key.level < key.level && node->children != nullptr) {
    node = node->children + geo::child_index(geo::ancestor(key, node->key.level + 1));
  }
  return node;
}

Node* NodePool::nearest(const geo::TileKey& key) { return nearest(roots_[key.face], key); }

Node* NodePool::find(const geo::TileKey& key) {
  Node* node = nearest(key);
  return node->key == key ? node : nullptr;
}

Node& NodePool::at(const geo::TileKey& key) {
  Node* node = nearest(key);
  while (node->key.level < key.level) {
    add_children(*node);
    node = nearest(*node, key);
  }
  return *node;
}

void NodePool::add_children(Node& node) {
  if (node.children != nullptr) return;
  if (free_.empty()) {
    quads_.emplace_back();
    if (free_.capacity() < quads_.size()) free_.reserve(2 * quads_.size());  // so that prune never allocates
    free_.push_back(&quads_.back());
  }
  Quad& quad = *free_.back();
  free_.pop_back();
  quad.in_use = true;
  for (int i = 0; i < 4; ++i) init(quad.nodes[static_cast<std::size_t>(i)], geo::child(node.key, i), &node);
  node.children = quad.nodes.data();
}

void NodePool::prune(FrameNumber frame, TimePoint now) {
  const auto is_idle = [&](const Node& node) {
    return node.children == nullptr && std::max(node.seen, node.sighted) + kFramesKept < frame &&
           std::ranges::all_of(node.parts, [&](const NodePart& part) {
             return part.wanted + kFramesKept < frame && can_request(part.life, now);
           });
  };
  for (std::size_t i = std::min(kQuadsPrunedPerFrame, quads_.size()); i > 0; --i) {
    next_to_prune_ = (next_to_prune_ + 1) % quads_.size();
    Quad& quad = quads_[next_to_prune_];
    if (!quad.in_use || !std::ranges::all_of(quad.nodes, is_idle)) continue;
    quad.nodes.front().parent->children = nullptr;
    quad.in_use = false;
    free_.push_back(&quad);
  }
}

void NodePool::forget_failures(Part part) {
  const auto forget = [&](Node& node) {
    if (std::holds_alternative<Failed>(node.part(part).life)) node.part(part).life = Wanted{};
  };
  std::ranges::for_each(roots_, forget);
  for (Quad& quad : quads_) std::ranges::for_each(quad.nodes, forget);
}

}  // namespace tellurion::surface
