#include "view/journey.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tellurion::view {
namespace {

constexpr double kRho = std::numbers::sqrt2;  // the paper's trade between zooming and panning
constexpr double kSmallestSize = 1.0;         // metres: lower poses count as this high

}  // namespace

Journey::Journey(const geo::Ellipsoid& ellipsoid, const Pose& from, const Pose& to)
    : from_(from),
      to_(to),
      turn_(turn_between(geo::normal_at(geo::place_of(from.position)).xyz,
                         geo::normal_at(geo::place_of(to.position)).xyz)),
      distance_(turn_.angle * ellipsoid.a()),
      from_size_(std::max(from.position.height.value, kSmallestSize)),
      to_size_(std::max(to.position.height.value, kSmallestSize)) {
  const double w0 = from_size_, w1 = to_size_, u1 = distance_;
  if (u1 < 1e-6 * std::min(w0, w1)) {  // the paper's special case: no way to go, only a height to change
    distance_ = 0.0;
    length_ = std::abs(std::log(w1 / w0)) / kRho;
    return;
  }
  const double rho2 = kRho * kRho;
  const double spread = rho2 * rho2 * u1 * u1;
  start_ = -std::asinh((w1 * w1 - w0 * w0 + spread) / (2.0 * w0 * rho2 * u1));
  length_ = (-std::asinh((w1 * w1 - w0 * w0 - spread) / (2.0 * w1 * rho2 * u1)) - start_) / kRho;
}

Pose Journey::pose_at(double fraction) const {
  if (fraction <= 0.0) return from_;
  if (fraction >= 1.0) return to_;
  const double eased = fraction * fraction * (3.0 - 2.0 * fraction);
  const double s = kRho * eased * length_;
  double way = eased;
  double size = from_size_ * std::pow(to_size_ / from_size_, eased);
  if (distance_ > 0.0) {
    size = from_size_ * std::cosh(start_) / std::cosh(s + start_);
    way = from_size_ / (kRho * kRho) * (std::cosh(start_) * std::tanh(s + start_) - std::sinh(start_)) / distance_;
  }
  // What the sizes left out of the heights.
  const double from_rest = from_.position.height.value - from_size_;
  const double to_rest = to_.position.height.value - to_size_;
  const double height = size + from_rest + (to_rest - from_rest) * eased;
  const glm::dvec3 normal = turn_.part(way) * geo::normal_at(geo::place_of(from_.position)).xyz;
  const geo::LatLon place = geo::place_of_normal({normal});
  // The attitude is carried along the great circle, and turned from the one to the other on the way.
  const glm::dquat from_attitude = glm::quat_cast(axes_of(from_));
  const glm::dquat to_attitude = glm::quat_cast(turn_.part(-1.0) * axes_of(to_));
  const glm::dmat3 axes = turn_.part(way) * glm::mat3_cast(glm::slerp(from_attitude, to_attitude, eased));
  return pose_with_axes({place.latitude, place.longitude, EllipsoidalHeight(height)}, axes);
}

}  // namespace tellurion::view
