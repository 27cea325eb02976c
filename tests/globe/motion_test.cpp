#include "globe/motion.h"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include "geo/ellipsoid.h"

using namespace tellurion;
using namespace tellurion::globe;
using namespace std::chrono_literals;

namespace {

view::Camera camera_at(double lat, double lon, double height) {
  const view::Pose pose{{to_radians(Degrees(lat)), to_radians(Degrees(lon)), EllipsoidalHeight(height)}, Radians(0), to_radians(Degrees(-30)), Radians(0)};
  return view::make_camera(geo::kWgs84, pose, to_radians(Degrees(45)), 640, 360);
}

double height_of(const view::Camera& camera) { return geo::to_geodetic(geo::kWgs84, camera.eye).height.value; }

const std::chrono::steady_clock::time_point kStart{std::chrono::hours(1)};

}  // namespace

TEST_CASE("Motion: an eye that rests goes nowhere, and one seen for the first time neither") {
  Motion motion;
  CHECK_FALSE(motion.foresee(geo::kWgs84, camera_at(10, 20, 1000), kStart));
  CHECK_FALSE(motion.foresee(geo::kWgs84, camera_at(10, 20, 1000), kStart + 20ms));
}

TEST_CASE("Motion: an even flight goes on for a second, looking the same way") {
  Motion motion;
  motion.foresee(geo::kWgs84, camera_at(10, 20, 5000), kStart);
  const view::Camera now = camera_at(10.0001, 20, 5000);
  const auto later = motion.foresee(geo::kWgs84, now, kStart + 50ms);
  REQUIRE(later);
  const geo::Geodetic there = geo::to_geodetic(geo::kWgs84, later->eye);
  CHECK(to_degrees(there.latitude).value == doctest::Approx(10.0021).epsilon(1e-6));
  CHECK(to_degrees(there.longitude).value == doctest::Approx(20));
  CHECK(there.height.value == doctest::Approx(5000).epsilon(1e-3));
  CHECK(later->axes == now.axes);
}

TEST_CASE("Motion: a dive ends above half the height") {
  Motion motion;
  motion.foresee(geo::kWgs84, camera_at(10, 20, 5110), kStart);
  const auto later = motion.foresee(geo::kWgs84, camera_at(10, 20, 5000), kStart + 10ms);
  REQUIRE(later);
  CHECK(height_of(*later) > 2500);
  CHECK(height_of(*later) < 5000);
}

TEST_CASE("Motion: a jump after a long pause is no motion") {
  Motion motion;
  motion.foresee(geo::kWgs84, camera_at(10, 20, 5000), kStart);
  CHECK_FALSE(motion.foresee(geo::kWgs84, camera_at(11, 20, 5000), kStart + 400ms));
}
