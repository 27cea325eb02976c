// What to load next so that the drawn cut becomes the wanted one.
#pragma once

#include <vector>

#include "surface/selection_wanted.h"

namespace tellurion::surface {

inline constexpr std::size_t kMostRequests = 256;
/// For so many frames a request stays wanted without being repeated.
inline constexpr FrameNumber kFramesWanted = 3;

/// Wanted are the geometry and the slope owner of every selected tile and the slot of its colour owner. A request's gain is
/// the error, at the tile's distance, of what is shown instead, less the wanted tile's own. Where what is shown is many
/// levels coarser, some levels between are asked for too, so that a view sharpens everywhere before it is perfect anywhere:
/// each of them counts the whole error at its nearest point and so comes before the tiles below it. As a stand-in goes only when
/// all below it can be drawn, the first tiles that are asked for below it all count its error where it is nearest.
class RequestList {
 public:
  explicit RequestList(NodePool& pool) : pool_(pool) { requests_.reserve(4 * kMostRequests); }

  /// Fills `requests`, greatest gain first, ties by key, and the waiting and selected part of `stats`.
  void find(const SelectionFrame& frame, std::vector<TileRequest>& requests, SelectionStats& stats);

 private:
  /// What is drawn in place of a node, and the screen error at its nearest point, pixels, as long as the node keeps it there.
  struct StandIn {
    const Node* node = nullptr;
    double held_up_px = 0;
  };

  void collect(const SelectionFrame& frame, Node& node, StandIn shown, SelectionStats& stats);
  bool want_colour(const SelectionFrame& frame, Node& node);
  void want(const SelectionFrame& frame, Node& node, Part part, double gain_px);

  NodePool& pool_;
  bool retries_later_ = false;
  std::vector<TileRequest> requests_;
};

}  // namespace tellurion::surface
