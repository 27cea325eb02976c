#include "view/journey.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "view/motion.h"

using namespace tellurion;
using namespace tellurion::geo;
using namespace tellurion::view;

namespace {

Pose pose(const std::string& text) { return parse_pose(text).value(); }
glm::dvec3 ground_of(const Pose& p) { return surface_point(kWgs84, normal_at(place_of(p.position))).xyz; }
glm::dvec3 eye_of(const Pose& p) { return to_ecef(kWgs84, p.position).xyz; }

}  // namespace

TEST_CASE("Journey: begins and ends where it should, without a jump on the way") {
  for (const auto& [from, to] :
       {std::pair{"46,7,3000,10,-20", "46.01,7.02,2000,200,-60"}, std::pair{"46,7,3000,10,-20", "-33,151,500,0,-90"},
        std::pair{"0,0,1000", "0,180,1000"}, std::pair{"90,0,1000", "-90,0,1e7"}, std::pair{"10,179,500", "10,-179,0"},
        std::pair{"46,7,3000,10,-20", "46,7,30,10,-20"}, std::pair{"46,7,3000,10,-20", "46,7,3000,100,-20"}}) {
    const std::string way = std::string(from) + " to " + to;
    CAPTURE(way);
    const Journey journey(kWgs84, pose(from), pose(to));
    CHECK(glm::distance(eye_of(journey.pose_at(0.0)), eye_of(pose(from))) == 0.0);
    CHECK(glm::distance(eye_of(journey.pose_at(1.0)), eye_of(pose(to))) == 0.0);
    constexpr int kSteps = 4000;
    Pose last = journey.pose_at(0.0);
    for (int i = 1; i <= kSteps; ++i) {
      const Pose next = journey.pose_at(i / double{kSteps});
      const double size = std::max({1.0, last.position.height.value, next.position.height.value});
      const double step = glm::distance(ground_of(next), ground_of(last)) +
                          std::abs(next.position.height.value - last.position.height.value);
      // The picture flows at a steady pace: per unit of the way, at most rho times what is seen (eased: 1.5 times), in
      // the sum of both directions sqrt(2) times that.
      REQUIRE(step < 3.01 * size * journey.length() / kSteps + 3.0 / kSteps + 1e-6);
      REQUIRE(glm::distance(axes_of(next)[2], axes_of(last)[2]) < 0.03);
      last = next;
    }
  }
}

TEST_CASE("Journey: rises for a long way, not for a short one") {
  const auto highest = [](const Journey& journey) {
    double height = 0.0;
    for (int i = 0; i <= 100; ++i) height = std::max(height, journey.pose_at(i / 100.0).position.height.value);
    return height;
  };
  CHECK(highest(Journey(kWgs84, pose("46,7,1000"), pose("46.0001,7,1000"))) < 1001.0);
  // Far apart the paper's way rises to rho^2 / 2 = 1 times the distance.
  const double arc = to_radians(Degrees(40.0)).value * kWgs84.a();
  CHECK(highest(Journey(kWgs84, pose("0,0,1000"), pose("0,40,1000"))) == doctest::Approx(arc).epsilon(1e-3));
}

TEST_CASE("Journey: follows the great circle") {
  const Journey journey(kWgs84, pose("0,-30,1000"), pose("0,50,1000"));
  for (int i = 0; i <= 20; ++i) {
    CHECK(std::abs(journey.pose_at(i / 20.0).position.latitude.value) < 1e-12);
  }
  CHECK(to_degrees(journey.pose_at(0.5).position.longitude).value == doctest::Approx(10.0).epsilon(1e-6));
}

TEST_CASE("Journey: a pure change of height is exponential, and as long as the paper says") {
  const Journey journey(kWgs84, pose("46,7,100"), pose("46,7,10000"));
  CHECK(journey.length() == doctest::Approx(std::log(100.0) / std::sqrt(2.0)));
  CHECK(journey.pose_at(0.5).position.height.value == doctest::Approx(1000.0));
  CHECK(Journey(kWgs84, pose("46,7,100"), pose("46,7,100,90")).length() == 0.0);
}

TEST_CASE("Journey: heights below the ellipsoid are reached too") {
  const Journey journey(kWgs84, pose("46,7,-300"), pose("46,7.5,-20"));
  CHECK(journey.pose_at(1e-9).position.height.value == doctest::Approx(-300.0).epsilon(1e-3));
  CHECK(journey.pose_at(1.0 - 1e-9).position.height.value == doctest::Approx(-20.0).epsilon(1e-3));
}
