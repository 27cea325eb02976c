#include "viewer/navigation.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

namespace tellurion::apps {
namespace {

constexpr double kOrbitPerPixel = 0.25 * std::numbers::pi / 180.0;  // radians
constexpr double kZoomSeconds = 0.08;                               // in which all but 1/e of the zoom is done
constexpr double kSettleSeconds = 0.12;
constexpr double kSettled = 0.05 * std::numbers::pi / 180.0;
constexpr double kKeySeconds = 0.1;      // in which held keys reach their speed
constexpr double kThrowSeconds = 0.06;   // a cursor that rested for longer throws nothing
constexpr double kSlowestSlide = 8.0;    // pixels a second
constexpr double kFarthestRadii = 60.0;  // height of the eye
constexpr double kStepsOfZoom = 0.9;     // what view::zoom leaves of the distance in a step
constexpr double kApproach = 0.35;       // what a double click leaves of the distance

/// The ground as one height: what is known of the place under the eye.
class LevelGround : public geo::HeightQuery {
 public:
  explicit LevelGround(EllipsoidalHeight height) : height_(height) {}
  void heights(std::span<const geo::LatLon>, std::span<EllipsoidalHeight> ground) const override {
    std::fill(ground.begin(), ground.end(), height_);
  }

 private:
  EllipsoidalHeight height_;
};

/// Share of the way that is gone after `seconds` of an exponential approach.
double share_of(double seconds, double time_constant) { return 1.0 - std::exp(-seconds / time_constant); }

glm::dvec2 middle_of(const view::Camera& camera) { return 0.5 * glm::dvec2(camera.width, camera.height); }

}  // namespace

Radians compass_of(const view::Pose& pose) {
  constexpr double kSteep = -80.0 * std::numbers::pi / 180.0;
  return pose.pitch.value < kSteep ? pose.heading + pose.roll : pose.heading;
}

Navigation::Navigation(const geo::Ellipsoid& ellipsoid, const view::Camera& start, Pick pick)
    : ellipsoid_(ellipsoid), camera_(start), pick_(std::move(pick)) {}

void Navigation::resize(glm::ivec2 size) {
  camera_.width = size.x;
  camera_.height = size.y;
}

void Navigation::jump_to(const view::Pose& pose) {
  camera_ = view::make_camera(ellipsoid_, pose, camera_.vertical_fov, camera_.width, camera_.height);
  motion_ = std::monostate();
  zooming_ = Zooming();
  grip_.reset();
}

std::optional<geo::Point<geo::Ecef>> Navigation::pick(glm::dvec2 pixel) {
  const auto point = pick_(camera_, pixel);
  grip_.reset();
  if (point) grip_ = Grip{*point, pixel};
  return point;
}

void Navigation::start_drag(const DragStart& drag, double now) {
  motion_ = std::monostate();
  if (drag.drag == Drag::look) {
    motion_ = Looking{drag.at};
  } else if (const auto point = pick(drag.at)) {
    if (drag.drag == Drag::pan)
      motion_ = Panning{*point, drag.at, glm::dvec2(0.0), now};
    else
      motion_ = Orbiting{*point, drag.at};
  } else {
    motion_ = Looking{drag.at};  // there is only sky to take hold of
  }
}

void Navigation::move_cursor(const CursorMove& move, double now) {
  if (auto* panning = std::get_if<Panning>(&motion_)) {
    const double seconds = std::max(now - panning->moved_at, 1e-3);
    const glm::dvec2 velocity = (move.at - panning->cursor) / seconds;
    panning->velocity = glm::mix(panning->velocity, velocity, share_of(seconds, 0.03));
    panning->cursor = move.at;
    panning->moved_at = now;
    camera_ = view::pan(ellipsoid_, camera_, panning->grabbed, move.at);
    grip_ = Grip{panning->grabbed, move.at};
  } else if (auto* orbiting = std::get_if<Orbiting>(&motion_)) {
    const glm::dvec2 by = (move.at - orbiting->cursor) * kOrbitPerPixel;
    orbiting->cursor = move.at;
    camera_ = view::orbit(ellipsoid_, camera_, orbiting->pivot, Radians(by.x), Radians(-by.y));
  } else if (auto* looking = std::get_if<Looking>(&motion_)) {
    const glm::dvec2 by = (move.at - looking->cursor) * camera_.pixel_angle();
    looking->cursor = move.at;
    camera_ = view::look_around(ellipsoid_, camera_, Radians(-by.x), Radians(by.y));
  }
}

void Navigation::end_drag(double now) {
  const auto* panning = std::get_if<Panning>(&motion_);
  if (panning && now - panning->moved_at < kThrowSeconds && glm::length(panning->velocity) > kSlowestSlide) {
    motion_ = Sliding{panning->grabbed, panning->cursor, panning->velocity};
  } else if (panning || std::holds_alternative<Orbiting>(motion_) || std::holds_alternative<Looking>(motion_)) {
    motion_ = std::monostate();
  }
}

void Navigation::wheel(const Wheel& wheel, const MotionSettings& settings) {
  if (moves_by_itself()) motion_ = std::monostate();
  // While the zoom goes on under a resting cursor, its target stays under the cursor.
  const bool same_target = zooming_.steps != 0.0 && glm::distance(wheel.at, zooming_.cursor) < 1.5;
  if (!same_target) {
    zooming_.cursor = wheel.at;
    zooming_.target = pick(wheel.at);
  }
  zooming_.steps += wheel.steps * std::log1p(-settings.wheel_step) / std::log(kStepsOfZoom);
}

void Navigation::approach(glm::dvec2 pixel, double now) {
  const auto place = pick(pixel);
  if (!place) return;
  const view::Pose pose = view::pose_of(ellipsoid_, camera_);
  const geo::Geodetic target = geo::to_geodetic(ellipsoid_, *place);
  view::Camera nearer = camera_;
  nearer.axes =
      view::axes_of({target, pose.heading, Radians(std::min(pose.pitch.value, -std::numbers::pi / 6)), Radians(0.0)});
  const double distance = kApproach * glm::distance(camera_.eye.xyz, place->xyz);
  nearer.eye = *place - nearer.forward() * distance;
  fly_to(view::pose_of(ellipsoid_, nearer), now);
}

void Navigation::fly_to(const view::Pose& pose, double now) {
  grip_.reset();
  zooming_ = Zooming();
  const view::Journey journey(ellipsoid_, view::pose_of(ellipsoid_, camera_), pose);
  const double seconds = std::clamp(0.8 * journey.length(), 0.5, 6.0);
  motion_ = Travelling{journey, now, seconds};
}

void Navigation::turn_north_up() { settle(true, false); }
void Navigation::reset_tilt() { settle(false, true); }

void Navigation::settle(bool to_north, bool to_nadir) {
  // Both at once where one follows the other before it is done.
  if (const auto* before = std::get_if<Settling>(&motion_)) {
    to_north = to_north || before->to_north;
    to_nadir = to_nadir || before->to_nadir;
  }
  grip_.reset();
  motion_ = Settling{pick_(camera_, middle_of(camera_)), to_north, to_nadir};
}

void Navigation::advance(double now, double seconds, glm::dvec3 held, EllipsoidalHeight ground,
                         const MotionSettings& settings) {
  if (zooming_.steps != 0.0) step_zoom(seconds);
  if (auto* sliding = std::get_if<Sliding>(&motion_))
    step(*sliding, seconds, settings);
  else if (auto* settling = std::get_if<Settling>(&motion_))
    step(*settling, seconds);
  else if (const auto* travelling = std::get_if<Travelling>(&motion_))
    step(*travelling, now);
  step_keys(seconds, held, ground, settings);
  const LevelGround level(ground);
  camera_ = view::keep_above({ellipsoid_, &level}, camera_, Metres(settings.least_height_m));
}

bool Navigation::moves_by_itself() const {
  return std::holds_alternative<Sliding>(motion_) || std::holds_alternative<Settling>(motion_) ||
         std::holds_alternative<Travelling>(motion_);
}

bool Navigation::moving() const { return moves_by_itself() || zooming_.steps != 0.0 || key_motion_ != glm::dvec3(0.0); }

void Navigation::step(Sliding& sliding, double seconds, const MotionSettings& settings) {
  sliding.cursor += sliding.velocity * share_of(seconds, 1.0 / settings.friction) / settings.friction;
  sliding.velocity *= std::exp(-seconds * settings.friction);
  const view::Camera before = camera_;
  camera_ = view::pan(ellipsoid_, camera_, sliding.grabbed, sliding.cursor);
  const bool stopped = glm::length(sliding.velocity) < kSlowestSlide || camera_.eye == before.eye;
  if (stopped) motion_ = std::monostate();
}

void Navigation::step(Settling& settling, double seconds) {
  const view::Pose pose = view::pose_of(ellipsoid_, camera_);
  double turn = settling.to_north ? -std::remainder(compass_of(pose).value, 2.0 * std::numbers::pi) : 0.0;
  double tilt = settling.to_nadir ? -std::numbers::pi / 2 - pose.pitch.value : 0.0;
  const bool done = std::abs(turn) < kSettled && std::abs(tilt) < kSettled;
  const double share = done ? 1.0 : share_of(seconds, kSettleSeconds);
  turn *= share;
  tilt *= share;
  camera_ = settling.pivot ? view::orbit(ellipsoid_, camera_, *settling.pivot, Radians(turn), Radians(tilt))
                           : view::look_around(ellipsoid_, camera_, Radians(turn), Radians(tilt));
  if (!done) return;
  if (settling.to_north) camera_ = view::north_up(ellipsoid_, camera_);
  motion_ = std::monostate();
}

void Navigation::step(const Travelling& travelling, double now) {
  const double fraction = std::min((now - travelling.started_at) / travelling.seconds, 1.0);
  const view::Pose pose = travelling.journey.pose_at(fraction);
  camera_ = view::make_camera(ellipsoid_, pose, camera_.vertical_fov, camera_.width, camera_.height);
  if (fraction >= 1.0) motion_ = std::monostate();
}

void Navigation::step_zoom(double seconds) {
  constexpr double kDone = 0.01;
  double steps = zooming_.steps * share_of(seconds, kZoomSeconds);
  if (std::abs(zooming_.steps - steps) < kDone) steps = zooming_.steps;
  zooming_.steps -= steps;
  const double height = geo::to_geodetic(ellipsoid_, camera_.eye).height.value;
  if (steps < 0.0 && height > kFarthestRadii * ellipsoid_.a()) {
    zooming_.steps = 0.0;
    return;
  }
  // Over the sky: along the ray, by the height of the eye.
  const auto target = zooming_.target.value_or(camera_.eye + camera_.ray(zooming_.cursor) * std::max(height, 1.0));
  camera_ = view::zoom(camera_, target, steps);
  if (steps < 0.0) turn_back_to_centre(-steps);
}

void Navigation::turn_back_to_centre(double steps) {
  const view::Pose pose = view::pose_of(ellipsoid_, camera_);
  const double share =
      glm::smoothstep(0.2, 1.5, pose.position.height.value / ellipsoid_.a()) * (1.0 - std::exp(-0.3 * steps));
  if (share <= 0.0) return;
  const glm::dmat3 down = view::axes_of({pose.position, Radians(0.0), Radians(-std::numbers::pi / 2), Radians(0.0)});
  const glm::dquat from = glm::quat_cast(camera_.axes), to = glm::quat_cast(down);
  constexpr double kThere = 1.0 - 1e-6;  // a sixth of a degree
  const bool there = std::abs(glm::dot(from, to)) > kThere;
  camera_.axes = there ? down : glm::mat3_cast(glm::normalize(glm::slerp(from, to, share)));
}

void Navigation::step_keys(double seconds, glm::dvec3 held, EllipsoidalHeight ground, const MotionSettings& settings) {
  key_motion_ = glm::mix(key_motion_, held, share_of(seconds, kKeySeconds));
  if (held == glm::dvec3(0.0) && glm::length(key_motion_) < 0.01) key_motion_ = glm::dvec3(0.0);
  if (key_motion_ == glm::dvec3(0.0)) return;
  if (!std::holds_alternative<Panning>(motion_)) motion_ = std::monostate();
  grip_.reset();

  // Over the ground, whatever the tilt: right and forward are level, up is up.
  const view::Pose before = view::pose_of(ellipsoid_, camera_);
  const glm::dmat3 level =
      view::axes_of({before.position, before.heading, Radians(0.0), Radians(0.0)});  // right, up, back
  const glm::dvec3 wanted = level * (settings.key_speed * glm::dvec3(key_motion_.x, key_motion_.z, -key_motion_.y));
  const glm::dvec3 along_axes(glm::dot(wanted, camera_.axes[0]), glm::dot(wanted, camera_.axes[1]),
                              -glm::dot(wanted, camera_.axes[2]));
  const LevelGround flat(ground);
  camera_ = view::fly({ellipsoid_, &flat}, camera_, along_axes, seconds);
}

}  // namespace tellurion::apps
