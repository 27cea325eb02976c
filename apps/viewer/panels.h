// The panels over the picture (Dear ImGui): toolbar, status line, statistics, layers, settings, help, hints.
#pragma once

#include <array>
#include <optional>

#include "globe/api.h"
#include "viewer/bindings.h"
#include "viewer/panel_kit.h"
#include "viewer/viewer_state.h"

namespace tellurion::apps {

class Window;

/// What the user asks for at the panels.
struct Asked {
  std::optional<Command> command;               ///< of a button that was pressed
  std::optional<std::size_t> fly_to;            ///< a layer
};

class Panels {
 public:
  /// Sets up Dear ImGui for `window`, which outlives this.
  explicit Panels(const Window& window);
  ~Panels();
  Panels(const Panels&) = delete;
  Panels& operator=(const Panels&) = delete;

  /// Begins a frame: from here on the panels know whether the mouse is theirs.
  void begin();
  bool take_mouse() const;
  bool take_keyboard() const;

  /// Lays out the panels, draws them over the picture and changes `state` and the globe's layers as the user asks.
  Asked draw(globe::Globe& globe, const globe::FrameStats& stats, const Moment& moment, ViewerState& state);

 private:
  void toolbar(ViewerState& state, Asked& asked);
  void statistics(const globe::Globe& globe, const globe::FrameStats& stats, bool& shown);
  void loader(const globe::Globe& globe);
  void layers(globe::Globe& globe, ViewerState& state, Asked& asked);
  void settings(ViewerState& state);
  void help(bool& shown);
  void hints(const globe::Globe& globe, bool& shown);
  void activity(const Moment& moment);
  void status_line(const globe::Globe& globe, const globe::FrameStats& stats, const Moment& moment);

  static constexpr std::size_t kGraphFrames = 120;
  std::array<float, kGraphFrames> frame_ms_{};  ///< a ring
  std::size_t next_frame_ = 0;
  Rate fetched_;  ///< bytes over the network
  float activity_bottom_ = 0;  ///< where what is told in the upper right corner ends
};

}  // namespace tellurion::apps
