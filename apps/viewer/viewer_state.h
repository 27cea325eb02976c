// What the user can change while the window is open.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "globe/api.h"

namespace tellurion::apps {

/// The world's time: runs at `rate` seconds a second while `running`. Without a time the light is the map-maker's.
struct WorldClock {
  std::optional<UtcTime> time;
  double rate = 1.0;
  bool running = false;
};

/// How the camera answers to the user.
struct MotionSettings {
  double wheel_step = 0.1;      ///< share of the distance that a step of the wheel takes away
  double friction = 4.0;        ///< by which a thrown globe slows down, 1/s
  double key_speed = 0.7;       ///< heights above the ground a second
  double least_height_m = 3.0;  ///< of the eye above the ground
};

struct PanelsShown {
  bool help = false;
  bool statistics = false;
  bool layers = false;
  bool settings = false;
  bool hints = true;
};

struct ViewerState {
  globe::ViewSettings view;
  WorldClock clock;
  MotionSettings motion;
  PanelsShown shown;
};

/// What only the moment knows, for the panels.
struct Moment {
  view::Pose pose;
  Radians compass;  ///< where the picture's upper edge points, clockwise from north
  double height_above_ground_m = 0;
  double metres_per_pixel = 0;            ///< at the middle of the picture; 0: the sky is there
  std::optional<geo::LatLon> cursor;      ///< where it points, about; nothing: the sky
  std::optional<double> cursor_height_m;  ///< of the ground there, if a gesture has just taken hold of it
  bool recording = false;
  bool replaying = false;
  std::string notice;  ///< what has just been done; empty: nothing
};

}  // namespace tellurion::apps
