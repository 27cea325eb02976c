// A node of the tile tree and the pool that owns all of them.
// Inside the tree nodes refer to each other by pointer: a node's address never changes, and no node is freed before its
// descendants. Everybody outside speaks of tiles by key.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "geo/ellipsoid.h"
#include "geo/tile_key.h"
#include "surface/selection_error.h"
#include "surface/surface_facts.h"
#include "surface/tile_bounds.h"
#include "surface/tile_life.h"
#include "surface/tile_tree.h"

namespace tellurion::surface {

using FrameNumber = std::uint64_t;

inline constexpr int kPartCount = 2;
constexpr std::size_t index_of(Part part) { return static_cast<std::size_t>(part); }

struct Node;

/// A part of a node: its life, who wants it, and its place in the order of use.
struct NodePart {
  PartLife life;
  FrameNumber wanted = 0;       ///< last frame that asked for it
  double gain_px = 0;           ///< screen error that it would have taken away then
  FrameNumber used = 0;         ///< last frame that could have drawn it
  Node* older = nullptr;        ///< neighbours in UseOrder; null if it is not listed
  Node* newer = nullptr;
};

struct Node {
  geo::TileKey key;
  Node* parent = nullptr;
  Node* children = nullptr;     ///< the first of four, in the order of geo::child; null for a leaf of the tree

  // What follows from the key.
  TileShape shape;
  TileFacts facts;
  float full_grid_error = 0;    ///< full_grid_curvature_error
  std::array<NodePart, kPartCount> parts;
  std::optional<Resident> built;  ///< its geometry as last built with these facts, there or not: a cut must not forget what it learnt

  // Bounds, kept as long as the heights stay.
  OrientedBox box;
  double box_lowest = 0;
  double box_highest = -1;      ///< below box_lowest: no box yet

  FrameNumber sighted = 0;      ///< last frame that looked how low its ground is
  OrientedBox column;           ///< from its lowest point up, at least to height 0; kept as `box` is
  double column_lowest = 0;
  double column_highest = -1;   ///< below column_lowest: none yet

  // What the frame `seen` found.
  FrameNumber seen = 0;
  bool visible = false;
  bool error_known = false;
  bool split = false;           ///< the wanted cut lies below
  PlaneSet planes = kAllPlanes; ///< crossed by the box
  double distance = 0;
  double error_m = 0;           ///< of the finest geometry as displayed, metres, judged;
  double bound_m = 0;           ///< and at most
  double geometry_px = 0;
  double texel_share = 0;       ///< see visible_share
  bool colour_suffices = false; ///< its texels, or those of an ancestor, are as fine as wanted
  double error_px = 0;
  Node* colour_owner = nullptr; ///< the nearest with colour of its own, and the nearest of those whose colour is resident
  Node* colour_shown = nullptr;
  Node* slope_owner = nullptr;
  Node* slope_shown = nullptr;
  FrameNumber awaited = 0;      ///< last frame in which colours finer than its own were wanted and not shown,
  TimePoint awaited_since;      ///< and the first of all up to it

  // What the frame `drawn` made of it.
  FrameNumber drawn = 0;
  FrameNumber merging = 0;      ///< last frame in which it gave way to its parent
  Node* colour_to = nullptr;    ///< fading from and to these (ancestors or itself)
  Node* colour_from = nullptr;
  float fade = 1;
  float morph = 1;
  std::uint8_t step = 0;        ///< of the mesh
  double shown_bound_m = 0;     ///< as bound_m, of that step
  double shown_px = 0;          ///< as geometry_px
  double sink_m = 0;            ///< see DrawTile::sink_depth
  FrameNumber bordered = 0;     ///< last frame in which it or a descendant was drawn,
  double border_error_m = 0;    ///< and the largest error among those

  // Requests made by the frame.
  std::array<FrameNumber, kPartCount> requested{};
  std::array<std::uint32_t, kPartCount> request_index{};

  NodePart& part(Part p) { return parts[index_of(p)]; }
  const NodePart& part(Part p) const { return parts[index_of(p)]; }
  const Resident* resident(Part p) const { return std::get_if<Resident>(&part(p).life); }
  bool is_root() const { return parent == nullptr; }
};

/// What the nearest ancestor with an outlook foretells of the node; null if none has one.
const Outlook::Block* foretold(const Node& node);

/// The resident parts of one kind, from the one to drop first: least recently used, descendants before their ancestors.
/// Roots are never listed.
class UseOrder {
 public:
  explicit UseOrder(Part part) : part_(part) {}

  /// Moves `node` to the recent end. To keep the order, its resident ancestors must follow.
  void touch(Node& node, FrameNumber frame);
  /// The same for `node` and all its resident ancestors.
  void touch_path(Node& node, FrameNumber frame);
  void remove(Node& node);
  const Node* oldest() const { return oldest_; }

 private:
  Part part_;
  Node* oldest_ = nullptr;
  Node* newest_ = nullptr;
};

/// All nodes: six roots and quads of siblings, reused through a free list. Bounded by what recent frames have visited and
/// what is resident: `prune` frees the rest.
class NodePool {
 public:
  NodePool(const geo::Ellipsoid& ellipsoid, std::shared_ptr<const SurfaceFacts> facts);

  void set_facts(std::shared_ptr<const SurfaceFacts> facts);

  const geo::Ellipsoid& ellipsoid() const { return ellipsoid_; }
  std::array<Node, geo::kFaceCount>& roots() { return roots_; }
  /// The node of `key`, or its nearest ancestor in the tree. `from` is an ancestor to start at.
  Node* nearest(const geo::TileKey& key);
  Node* nearest(Node& from, const geo::TileKey& key);
  /// The node of `key`; null if it is not in the tree.
  Node* find(const geo::TileKey& key);
  /// The node of `key`, made with its ancestors if need be.
  Node& at(const geo::TileKey& key);
  void add_children(Node& node);

  /// Frees siblings that no frame has visited for a while and of which nothing is resident, asked for or waiting to be
  /// retried. Looks at a bounded number of them per call, in turn.
  void prune(FrameNumber frame, TimePoint now);

  void forget_failures(Part part);

 private:
  struct Quad {
    std::array<Node, 4> nodes;
    bool in_use = false;
  };

  void init(Node& node, const geo::TileKey& key, Node* parent) const;
  void learn(Node& node) const;

  geo::Ellipsoid ellipsoid_;
  std::shared_ptr<const SurfaceFacts> facts_;
  std::array<Node, geo::kFaceCount> roots_;
  std::deque<Quad> quads_;
  std::vector<Quad*> free_;
  std::size_t next_to_prune_ = 0;
};

}  // namespace tellurion::surface
