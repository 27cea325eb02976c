#include "view/flight.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

namespace tellurion::view {
namespace {

constexpr double kLargestStep = -0.985;  ///< cosine of 170 degrees: beyond it the way between two samples is arbitrary

glm::dvec4 quaternion_of(const glm::dmat3& axes) {
  const glm::dquat q = glm::quat_cast(axes);
  return {q.x, q.y, q.z, q.w};
}

glm::dmat3 axes_of_quaternion(const glm::dvec4& v) {
  return glm::mat3_cast(glm::normalize(glm::dquat(v.w, v.x, v.y, v.z)));
}

/// Rate at a knot from the mean rates before and after it: that of the parabola through the three knots, but never more
/// than three times either (the bound of Fritsch and Carlson, which forbids overshooting where motion starts or stops).
template <class Value>
Value limited_rate(const Value& before, double before_s, const Value& after, double after_s) {
  const Value rate = (before * after_s + after * before_s) / (before_s + after_s);
  const double largest = 3.0 * std::min(glm::length(before), glm::length(after));
  const double length = glm::length(rate);
  return length > largest ? rate * (largest / length) : rate;
}

/// The same for a height, which must not leave the range of its neighbours: level at peaks and in hollows.
double limited_rate(double before, double before_s, double after, double after_s) {
  if (before * after <= 0.0) return 0.0;
  const double rate = (before * after_s + after * before_s) / (before_s + after_s);
  return std::copysign(std::min(std::abs(rate), 3.0 * std::min(std::abs(before), std::abs(after))), before);
}

/// Cubic between two knots; `f` in [0, 1], rates per second.
template <class Value>
Value hermite(const Value& v0, const Value& rate0, const Value& v1, const Value& rate1, double f, double duration_s) {
  const double g = 1.0 - f;
  return v0 + (v1 - v0) * (f * f * (3.0 - 2.0 * f)) + rate0 * (duration_s * f * g * g) -
         rate1 * (duration_s * f * f * g);
}

}  // namespace

Result<Flight> Flight::create(std::vector<FlightSample> samples) {
  const auto fail = [](std::string why) { return Error{ErrorCode::invalid_argument, "flight: " + std::move(why)}; };
  if (samples.empty()) return fail("no samples");
  Flight flight;
  flight.knots_.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Pose& pose = samples[i].pose;
    Knot knot;
    knot.normal = geo::normal_at(geo::place_of(pose.position)).xyz;
    knot.turn = quaternion_of(axes_of(pose));
    knot.height = pose.position.height.value;
    if (i > 0) {
      const Knot& previous = flight.knots_.back();
      const std::string number = std::to_string(i + 1);
      if (!(samples[i].time_s - samples[i - 1].time_s >= kShortestStep_s))
        return fail("sample " + number + " is not at least 1e-6 s later than the one before");
      if (glm::dot(knot.normal, previous.normal) < kLargestStep) {
        return fail("sample " + number + " lies on the other side of the planet: add samples on the way");
      }
      if (glm::dot(knot.turn, previous.turn) < 0.0) knot.turn = -knot.turn;
    }
    flight.knots_.push_back(knot);
  }
  // At its ends the flight keeps the mean rate of the first and the last stretch.
  const std::size_t last = samples.size() - 1;
  for (std::size_t i = 0; last > 0 && i <= last; ++i) {
    const std::size_t before = i > 0 ? i - 1 : 0;
    const std::size_t after = std::min(i + 1, last);
    const double before_s = i > 0 ? samples[i].time_s - samples[before].time_s : 0.0;
    const double after_s = i < last ? samples[after].time_s - samples[i].time_s : 0.0;
    Knot& here = flight.knots_[i];
    const auto rate = [&](const auto& v0, const auto& v1, const auto& v2) {
      if (i == 0) return (v2 - v1) / after_s;
      if (i == last) return (v1 - v0) / before_s;
      return limited_rate((v1 - v0) / before_s, before_s, (v2 - v1) / after_s, after_s);
    };
    here.normal_rate = rate(flight.knots_[before].normal, here.normal, flight.knots_[after].normal);
    here.turn_rate = rate(flight.knots_[before].turn, here.turn, flight.knots_[after].turn);
    here.height_rate = rate(flight.knots_[before].height, here.height, flight.knots_[after].height);
  }
  flight.samples_ = std::move(samples);
  return flight;
}

Pose Flight::pose_at(double time_s) const {
  assert(std::isfinite(time_s));
  const auto next = std::ranges::upper_bound(samples_, time_s, {}, &FlightSample::time_s);
  if (next == samples_.begin()) return samples_.front().pose;
  if (next == samples_.end()) return samples_.back().pose;
  const auto index = static_cast<std::size_t>(next - samples_.begin());
  const double since_s = time_s - samples_[index - 1].time_s;
  if (since_s == 0.0) return samples_[index - 1].pose;
  const double duration_s = next->time_s - samples_[index - 1].time_s;
  const double f = since_s / duration_s;
  const Knot& a = knots_[index - 1];
  const Knot& b = knots_[index];
  const geo::LatLon place =
      geo::place_of_normal({hermite(a.normal, a.normal_rate, b.normal, b.normal_rate, f, duration_s)});
  const double height = hermite(a.height, a.height_rate, b.height, b.height_rate, f, duration_s);
  return pose_with_axes({place.latitude, place.longitude, EllipsoidalHeight(height)},
                        axes_of_quaternion(hermite(a.turn, a.turn_rate, b.turn, b.turn_rate, f, duration_s)));
}

}  // namespace tellurion::view
