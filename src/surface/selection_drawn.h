// The drawn cut: the best complete cut that can be shown now, and how it is shown.
#pragma once

#include <array>
#include <vector>

#include "surface/selection_wanted.h"

namespace tellurion::surface {

/// A node that should split is replaced by its children only if all of its visible part can be drawn below it; else it is
/// drawn itself if its geometry is resident; else the failure passes up. The roots are resident, so there is never a hole,
/// and a tile is never drawn together with an ancestor. A wanted tile that is not resident may be replaced by finer ones
/// that still are (after zooming out).
class DrawnCut {
 public:
  DrawnCut(NodePool& pool, const WantedCut& wanted, std::array<UseOrder, kPartCount>& orders)
      : pool_(pool), wanted_(wanted), orders_(orders) {}

  /// Fills `tiles`, sorted front to back, and the drawn part of `stats`.
  void find(const SelectionFrame& frame, std::vector<DrawTile>& tiles, SelectionStats& stats);

  /// The roots in view, laid flat as deep as the deepest ground: for frames in which tiles stand in for finer ones. Such a tile may lie
  /// lower than the true surface, and show past its border where what is drawn of its neighbour is out of view.
  void lay_floor(const SelectionFrame& frame, std::vector<DrawTile>& floor) const;

  /// Whether a fade or morph is under way.
  bool in_transition() const { return in_transition_; }

 private:
  bool draw(const SelectionFrame& frame, Node& node);
  bool draw_children(const SelectionFrame& frame, Node& node);
  bool draw_finer(const SelectionFrame& frame, Node& node, int levels);
  bool draw_merging(const SelectionFrame& frame, Node& node);
  void advance(const SelectionFrame& frame, Node& node);
  void mark_border(const SelectionFrame& frame, Node& node);
  double border_error(const SelectionFrame& frame, const Node& node, geo::Side side);
  DrawTile tile_of(const SelectionFrame& frame, Node& node);

  NodePool& pool_;
  const WantedCut& wanted_;
  std::array<UseOrder, kPartCount>& orders_;
  std::vector<Node*> nodes_;
  bool in_transition_ = false;
};

}  // namespace tellurion::surface
