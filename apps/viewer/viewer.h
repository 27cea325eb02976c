// The window program: takes input, moves the camera, draws frames, and rests while nothing changes.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/bounded_queue.h"
#include "globe/api.h"
#include "options.h"
#include "viewer/flight_recorder.h"
#include "viewer/input.h"
#include "viewer/navigation.h"
#include "viewer/panels.h"
#include "viewer/viewer_state.h"
#include "viewer/window.h"

namespace tellurion::apps {

struct ViewerOptions : Options {
  std::filesystem::path flight_file = "tellurion-flight.csv";
  std::filesystem::path camera_log;  ///< where the camera is at each frame, as a flight; empty: nowhere
};

class Viewer {
 public:
  /// Opens the window and the world. Errors: of the window, the driver, the world.
  static Result<std::unique_ptr<Viewer>> open(const ViewerOptions& options);
  ~Viewer();

  /// Runs until the window is closed.
  void run();

 private:
  Viewer(const ViewerOptions& options, Window window, FlightRecorder recorder);
  Result<void> open_world();
  Result<void> open_logs();

  void frame(double now, double seconds);
  void handle(const std::vector<Event>& events, double now);
  void obey(Command command, double now);
  void toggle_recording(double now);
  void toggle_replay(double now);
  void save_screenshot();
  void add(const Drop& drop);
  void fly_to(std::optional<std::size_t> layer);
  void save_layers();
  void say(const std::string& text);
  void say(const std::string& text, double seconds);

  /// What a worker has done for the user.
  struct Done {
    std::string news;  ///< to be said; empty: nothing
    std::vector<Error> errors;
    std::optional<view::Pose> fly_to{};
  };
  /// Has a worker do what reads or writes files.
  void have_done(std::function<Done()> work);
  void take_done(double now);

  /// Whether there is something new to show.
  bool picture_changes(double now);
  /// How long nothing can change unless the user acts.
  double resting_seconds(double now) const;
  bool moves_by_itself() const;
  /// Looks up the ground under the eye; whether the eye is too near to it.
  bool look_below(double now);
  void advance_clock(double seconds);
  Moment moment(double now) const;
  void find_cursor(Moment& moment) const;
  void write_logs(double now);

  ViewerOptions options_;
  Window window_;  ///< first: all below need its context, and go before it
  std::unique_ptr<gpu::RenderThread> thread_;
  std::unique_ptr<globe::Globe> globe_;
  std::unique_ptr<globe::GlobeView> view_;
  Input input_;
  Panels panels_;
  ViewerState state_;
  std::optional<Navigation> navigation_;
  FlightRecorder recorder_;
  std::ofstream trace_;
  std::ofstream camera_log_;

  EllipsoidalHeight ground_{0.0};  ///< under the eye, as displayed
  double last_look_below_ = 0;
  double last_frame_ended_ = 0;
  double draw_until_ = 0;          ///< what has arrived may still be fading in
  int frames_owed_ = 3;            ///< panels need some frames to settle
  std::int64_t shown_bytes_ = -1;  ///< uploaded when the last frame was drawn
  bool shown_complete_ = false;
  std::shared_ptr<BoundedQueue<Done>> done_ = std::make_shared<BoundedQueue<Done>>(64);
  std::string notice_;
  double notice_until_ = 0;
  int last_screenshot_ = 0;
};

}  // namespace tellurion::apps
