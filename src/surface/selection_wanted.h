// The wanted cut: which tiles a view needs, whether they are there or not.
#pragma once

#include <array>

#include "surface/selection_node.h"

namespace tellurion::surface {

/// What a frame is about; shared by all steps of a selection.
struct SelectionFrame {
  FrameNumber number = 0;
  FrameNumber last = 0;        ///< the one before that was drawn
  TimePoint now;
  SelectionSettings settings;
  ErrorView errors;
  ViewVolume volume;
  Horizon horizon;
  double eye_height = 0;       ///< metres above the ellipsoid
  double lowest = 0;           ///< of all heights displayed, at most 0
  float transition_step = 1;   ///< share of a transition that passes in this frame
  bool was_drawn(const Node& node) const { return node.drawn == last; }
};

SelectionFrame make_frame(NodePool& pool, const view::Camera& camera, const SelectionSettings& settings,
                          FrameNumber number, FrameNumber last, TimePoint now);

/// Finds the wanted cut, marks it in the nodes (`seen`, `visible`, `split`) and touches what it visits.
///
/// A node is split while its error exceeds the wanted one. Where the facts give the error nothing needs to be loaded to
/// know it, so levels are skipped; where they do not, the tile itself has to be resident, and a tile of which nothing is
/// known yet ends the cut until it is. Built metrics also count where facts said that the tile is good enough. So once
/// everything wanted is resident, the cut depends on camera, settings, facts and metrics only.
/// What was built is remembered when it goes, its errors and its size: a cut that turned out too coarse or too large is not
/// tried again and again.
class WantedCut {
 public:
  WantedCut(NodePool& pool, std::array<UseOrder, kPartCount>& orders) : pool_(pool), orders_(orders) {}

  /// The wanted error is raised to sse_px * 1.25^k with the smallest k that keeps to settings.max_tiles and max_bytes.
  void find(const SelectionFrame& frame);

  double effective_sse_px() const { return effective_sse_px_; }
  int tiles_visited() const { return visited_; }
  int tiles_selected() const { return selected_; }

  /// Judges `node` once per frame; its parent has been judged before.
  void see(const SelectionFrame& frame, Node& node) const;
  /// The coarsest triangulation of a resident mesh that is good enough; the finest if none is, or for metrics without errors.
  void choose_step(const SelectionFrame& frame, Node& node) const;

 private:
  bool fits(const SelectionFrame& frame, int steps);
  /// Whether what was selected is at most `factor` times what is allowed.
  bool within(const SelectionSettings& settings, std::size_t factor) const;
  void refine(const SelectionFrame& frame, Node& node);
  void touch(const SelectionFrame& frame, Node& node) const;
  bool wants_split(const SelectionFrame& frame, const Node& node) const;

  NodePool& pool_;
  std::array<UseOrder, kPartCount>& orders_;
  int steps_ = 0;               ///< k of the last frame: where the search for the next one starts
  double effective_sse_px_ = 0;
  double split_distance_ = 0;
  double split_solid_angle_ = 0;
  int visited_ = 0;
  int selected_ = 0;
  std::size_t selected_bytes_ = 0;
  std::size_t selected_built_ = 0;       ///< those of them whose mesh's size is known
  std::size_t selected_mesh_bytes_ = 0;  ///< of these
  std::size_t typical_mesh_bytes_ = 96u << 10;  ///< of a mesh not built yet: the last frame's mean
};

}  // namespace tellurion::surface
