#include "view/camera.h"

#include <doctest/doctest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <string>

using namespace tellurion;
using namespace tellurion::geo;
using namespace tellurion::view;

namespace {

constexpr unsigned kSeed = 4242;
constexpr double kPi = std::numbers::pi;

Camera camera_at(const std::string& pose, double vfov_degrees = 45.0) {
  return make_camera(kWgs84, parse_pose(pose).value(), to_radians(Degrees(vfov_degrees)), 1280, 720);
}

double degrees(Radians angle) { return to_degrees(angle).value; }

}  // namespace

TEST_CASE("parse_pose: reads three to six numbers, looking straight down by default") {
  const Pose shortest = parse_pose("46.7,-121.76,6500").value();
  CHECK(degrees(shortest.position.latitude) == doctest::Approx(46.7).epsilon(1e-15));
  CHECK(degrees(shortest.position.longitude) == doctest::Approx(-121.76).epsilon(1e-15));
  CHECK(shortest.position.height.value == 6500.0);
  CHECK(shortest.heading.value == 0.0);
  CHECK(shortest.pitch.value == -kPi / 2.0);
  CHECK(shortest.roll.value == 0.0);
  const Pose longest = parse_pose(" -90, 540 ,-10.5,359,-10,1e1").value();
  CHECK(longest.position.latitude.value == -kPi / 2.0);
  CHECK(longest.position.height.value == -10.5);
  CHECK(degrees(longest.heading) == doctest::Approx(359.0));
  CHECK(degrees(longest.pitch) == doctest::Approx(-10.0));
  CHECK(degrees(longest.roll) == doctest::Approx(10.0));
}

TEST_CASE("parse_pose: refuses all else and names the text") {
  for (const std::string text :
       {"", "1", "1,2", "1,2,", ",,", "1,2,3,", "1,2,3,4,5,6,7", "1,2,x", "1 2 3", "nan,0,0", "0,inf,0", "90.0001,0,0",
        "-91,0,0", "0,0,0,0,90.1", "0,0,0,0,-91", "0,0,1e13", "1;2;3"}) {
    CAPTURE(text);
    const Result<Pose> result = parse_pose(text);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::invalid_argument);
    CHECK(result.error().message.find("'" + text + "'") != std::string::npos);
  }
  CHECK(parse_pose("1,2,x").error().message.find("height is no number") != std::string::npos);
  CHECK(parse_pose("95,0,0").error().message.find("lat is beyond 90 degrees") != std::string::npos);
}

TEST_CASE("make_camera: axes point right, up and back") {
  const Camera north = camera_at("0,0,0,0,0");  // at (a, 0, 0) with a level view to the north
  CHECK(glm::distance(north.forward().xyz, glm::dvec3(0.0, 0.0, 1.0)) < 1e-15);
  CHECK(glm::distance(north.axes[0], glm::dvec3(0.0, 1.0, 0.0)) < 1e-15);
  CHECK(glm::distance(north.axes[1], glm::dvec3(1.0, 0.0, 0.0)) < 1e-15);
  const Camera east = camera_at("0,0,0,90,0");
  CHECK(glm::distance(east.forward().xyz, glm::dvec3(0.0, 1.0, 0.0)) < 1e-15);
  const Camera down = camera_at("0,0,100");
  CHECK(glm::distance(down.forward().xyz, glm::dvec3(-1.0, 0.0, 0.0)) < 1e-15);
  CHECK(glm::distance(down.axes[1], glm::dvec3(0.0, 0.0, 1.0)) < 1e-15);  // north is up in the picture
  const Camera rolled = camera_at("0,0,0,0,0,90");                        // right side down
  CHECK(glm::distance(rolled.axes[0], glm::dvec3(-1.0, 0.0, 0.0)) < 1e-15);
}

TEST_CASE("pose_of: undoes make_camera, at poles and straight down too") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    Pose pose;
    pose.position = {Radians(std::asin(unit(random))), Radians(kPi * unit(random)),
                     EllipsoidalHeight(1e6 * unit(random))};
    pose.heading = Radians(kPi * unit(random));
    pose.pitch = Radians(1.57 * unit(random));
    pose.roll = Radians(3.1 * unit(random));
    if (i % 5 == 1) pose.position.latitude = Radians(i % 2 == 0 ? kPi / 2.0 : -kPi / 2.0);
    if (i % 5 == 2) pose.position.longitude = Radians(kPi);
    if (i % 5 == 3) pose.roll = Radians(0.0);
    const Camera camera = make_camera(kWgs84, pose, Radians(0.8), 640, 480);
    const Pose back = pose_of(kWgs84, camera);
    const Camera again = make_camera(kWgs84, back, Radians(0.8), 640, 480);
    REQUIRE(glm::distance(camera.eye.xyz, again.eye.xyz) < 2e-8);
    for (int axis = 0; axis < 3; ++axis) REQUIRE(glm::distance(camera.axes[axis], again.axes[axis]) < 1e-12);
    if (std::abs(pose.position.latitude.value) < 1.5) {
      REQUIRE(std::abs(std::remainder(back.heading.value - pose.heading.value, 2.0 * kPi)) < 1e-11);
      REQUIRE(std::abs(back.pitch.value - pose.pitch.value) < 1e-11);
      REQUIRE(std::abs(std::remainder(back.roll.value - pose.roll.value, 2.0 * kPi)) < 1e-11);
    }
  }
}

TEST_CASE("pose_of: straight down all turning is heading") {
  const Pose pose = pose_of(kWgs84, camera_at("10,20,3000,30,-90,0"));
  CHECK(degrees(pose.heading) == doctest::Approx(30.0));
  CHECK(degrees(pose.pitch) == doctest::Approx(-90.0));
  CHECK(pose.roll.value == 0.0);
  CHECK(degrees(pose_of(kWgs84, camera_at("10,20,3000,30,-90,15")).heading) == doctest::Approx(45.0));
}

TEST_CASE("Camera::ray: the middle looks forward, the upper border half a field of view higher") {
  const Camera camera = camera_at("46.7,-121.76,6500,30,-10,5", 50.0);
  CHECK(glm::distance(camera.ray({640.0, 360.0}).xyz, camera.forward().xyz) < 1e-15);
  const glm::dvec3 top = camera.ray({640.0, 0.0}).xyz;
  CHECK(std::acos(glm::dot(top, camera.forward().xyz)) == doctest::Approx(25.0 * kPi / 180.0));
  CHECK(glm::dot(top, camera.axes[1]) > 0.0);
  CHECK(glm::dot(camera.ray({1280.0, 360.0}).xyz, camera.axes[0]) > 0.0);
}

TEST_CASE("Camera::pixel_angle: is the step of rays in the middle") {
  const Camera camera = camera_at("0,0,1000");
  const glm::dvec3 step = camera.ray({641.0, 360.0}).xyz - camera.ray({640.0, 360.0}).xyz;
  CHECK(glm::length(step) == doctest::Approx(camera.pixel_angle()).epsilon(1e-5));
}

TEST_CASE("make_frustum: a ray is inside exactly where its pixel is in the picture") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> around(-1.0, 2.0);
  const Camera camera = camera_at("46.7,-121.76,6500,30,-10,5");
  const Frustum frustum = make_frustum(camera);
  const auto inside = [&](glm::dvec2 pixel, int plane) {
    return glm::dot(frustum.inward[plane], camera.ray(pixel).xyz) >= 0.0;
  };
  for (int i = 0; i < 5000; ++i) {
    const glm::dvec2 pixel(1280.0 * around(random), 720.0 * around(random));
    REQUIRE(inside(pixel, 0) == (pixel.x >= 0.0));
    REQUIRE(inside(pixel, 1) == (pixel.x <= 1280.0));
    REQUIRE(inside(pixel, 2) == (pixel.y <= 720.0));
    REQUIRE(inside(pixel, 3) == (pixel.y >= 0.0));
  }
  CHECK(frustum.forward == camera.forward().xyz);
  for (const glm::dvec3& normal : frustum.inward) CHECK(glm::length(normal) == doctest::Approx(1.0).epsilon(1e-15));
}
