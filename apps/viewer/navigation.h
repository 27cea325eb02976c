// Turns what the user does into motions of the camera: a small state machine over view/controllers.
#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <variant>

#include "globe/api.h"
#include "viewer/input.h"
#include "viewer/viewer_state.h"

namespace tellurion::apps {

/// Where the picture's upper edge points, clockwise from north. Looking down, heading and roll turn about the same
/// axis.
Radians compass_of(const view::Pose& pose);

class Navigation {
 public:
  /// The displayed ground under a pixel; nothing for the sky. Asked once for each gesture.
  using Pick = std::function<std::optional<geo::Point<geo::Ecef>>(const view::Camera&, glm::dvec2)>;

  Navigation(const geo::Ellipsoid& ellipsoid, const view::Camera& start, Pick pick);

  const view::Camera& camera() const { return camera_; }
  void resize(glm::ivec2 size);
  /// Puts the camera there at once and ends every motion.
  void jump_to(const view::Pose& pose);

  // Gestures, at `now` seconds of any clock that runs evenly.
  void start_drag(const DragStart& drag, double now);
  void move_cursor(const CursorMove& move, double now);
  void end_drag(double now);
  void wheel(const Wheel& wheel, const MotionSettings& settings);
  /// Flies to the place under the cursor and comes nearer to it.
  void approach(glm::dvec2 pixel, double now);
  void fly_to(const view::Pose& pose, double now);
  void turn_north_up();
  void reset_tilt();

  /// Moves on by `seconds`. `held`: right, forward, up over the ground. `ground`: displayed height of the ground under
  /// the eye.
  void advance(double now, double seconds, glm::dvec3 held, EllipsoidalHeight ground, const MotionSettings& settings);

  /// Whether the camera moves by itself, so that the next frame will differ.
  bool moving() const;

  /// A place of the ground that is known to be at a pixel.
  struct Grip {
    geo::Point<geo::Ecef> place;
    glm::dvec2 pixel;
  };
  /// What the last gesture took hold of; nothing once the camera has moved on by other means.
  const std::optional<Grip>& grip() const { return grip_; }

 private:
  struct Panning {
    geo::Point<geo::Ecef> grabbed;
    glm::dvec2 cursor;
    glm::dvec2 velocity{0.0};  ///< pixels a second
    double moved_at = 0;
  };
  struct Orbiting {
    geo::Point<geo::Ecef> pivot;
    glm::dvec2 cursor;
  };
  struct Looking {
    glm::dvec2 cursor;
  };
  /// A thrown globe: the cursor slides on.
  struct Sliding {
    geo::Point<geo::Ecef> grabbed;
    glm::dvec2 cursor;
    glm::dvec2 velocity;
  };
  /// Turns to the north or straight down about what is in the middle of the picture.
  struct Settling {
    std::optional<geo::Point<geo::Ecef>> pivot;
    bool to_north;
    bool to_nadir;
  };
  struct Travelling {
    view::Journey journey;
    double started_at;
    double seconds;
  };
  struct Zooming {
    glm::dvec2 cursor{-1.0};
    std::optional<geo::Point<geo::Ecef>> target;
    double steps = 0;  ///< still to come
  };
  using Motion = std::variant<std::monostate, Panning, Orbiting, Looking, Sliding, Settling, Travelling>;

  std::optional<geo::Point<geo::Ecef>> pick(glm::dvec2 pixel);
  bool moves_by_itself() const;
  void settle(bool to_north, bool to_nadir);
  void step(Sliding& sliding, double seconds, const MotionSettings& settings);
  void step(Settling& settling, double seconds);
  void step(const Travelling& travelling, double now);
  void step_zoom(double seconds);
  void turn_back_to_centre(double steps);
  void step_keys(double seconds, glm::dvec3 held, EllipsoidalHeight ground, const MotionSettings& settings);

  geo::Ellipsoid ellipsoid_;
  view::Camera camera_;
  Pick pick_;
  Motion motion_;
  Zooming zooming_;
  glm::dvec3 key_motion_{0.0};
  std::optional<Grip> grip_;
};

}  // namespace tellurion::apps
