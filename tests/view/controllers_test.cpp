#include "view/controllers.h"

#include <doctest/doctest.h>

#include <span>

#include "view/motion.h"

using namespace tellurion;
using namespace tellurion::geo;
using namespace tellurion::view;

namespace {

constexpr unsigned kSeed = 99;
const Ground kBareGround{kWgs84};

/// A level plateau.
class Plateau final : public HeightQuery {
 public:
  explicit Plateau(double metres) : metres_(metres) {}
  void heights(std::span<const LatLon>, std::span<EllipsoidalHeight> ground) const override {
    for (EllipsoidalHeight& height : ground) height = EllipsoidalHeight(metres_);
  }

 private:
  double metres_;
};

double height_of(const Camera& camera) { return to_geodetic(kWgs84, camera.eye).height.value; }
double degrees(Radians angle) { return to_degrees(angle).value; }

void check_orthonormal(const Camera& camera) {
  REQUIRE(glm::distance(glm::cross(camera.axes[0], camera.axes[1]), camera.axes[2]) < 1e-14);
  REQUIRE(std::abs(glm::length(camera.axes[0]) - 1.0) < 1e-14);
  REQUIRE(std::abs(glm::length(camera.axes[1]) - 1.0) < 1e-14);
}

}  // namespace

TEST_CASE("pan: the ground that was under one pixel is under the other, anywhere, in any attitude") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  int pans = 0;
  for (int i = 0; i < 20000; ++i) {
    const Camera camera = random_camera(random);
    const glm::dvec2 from = random_pixel(random), to = random_pixel(random);
    const auto grabbed = pick(kBareGround, camera, from);
    if (!grabbed || !pick(kBareGround, camera, to)) continue;
    const Camera moved = pan(kWgs84, camera, *grabbed, to);
    if (moved.eye == camera.eye) continue;  // beside the sphere through the point
    ++pans;
    CAPTURE(i);
    REQUIRE(glm::distance(pixel_of(moved, *grabbed), to) < 0.01);
    REQUIRE(std::abs(height_of(moved) - height_of(camera)) < 1e-4 * height_of(camera));
    check_orthonormal(moved);
  }
  CHECK(pans > 10000);
}

TEST_CASE("pan: keeps the attitude to the horizon over a long way") {
  Camera camera = camera_at("10,20,100000,0,-90");
  for (int i = 0; i < 100; ++i)
    camera = pan(kWgs84, camera, *pick(kBareGround, camera, {640.0, 360.0}), {640.0, 700.0});
  const Pose pose = pose_of(kWgs84, camera);
  CHECK(degrees(pose.position.latitude) > 40.0);
  CHECK(degrees(pose.pitch) < -89.9);
  CHECK(std::abs(pose.position.height.value - 100000.0) < 1.0);
}

TEST_CASE("pan: a ray beside the planet moves nothing") {
  const Camera camera = camera_at("0,0,20000000");
  const Camera moved = pan(kWgs84, camera, *pick(kBareGround, camera, {640.0, 360.0}), {0.0, 0.0});
  CHECK(moved.eye == camera.eye);
}

TEST_CASE("pan: holds a mountain that rises above the eye") {
  const Camera camera = camera_at("46,8,2000,0,3");
  const Point<Ecef> summit =
      to_ecef(kWgs84, {to_radians(Degrees(46.2)), to_radians(Degrees(8.01)), EllipsoidalHeight(4500.0)});
  const glm::dvec2 seen = pixel_of(camera, summit);
  const Camera moved = pan(kWgs84, camera, summit, seen + glm::dvec2(30.0, 5.0));
  CHECK(glm::distance(pixel_of(moved, summit), seen + glm::dvec2(30.0, 5.0)) < 0.01);
  CHECK(glm::distance(moved.eye.xyz, camera.eye.xyz) < 10000.0);
}

TEST_CASE("zoom: keeps the point under the cursor and takes a tenth of the way") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const Camera camera = random_camera(random);
    const glm::dvec2 pixel = random_pixel(random);
    const auto target = pick(kBareGround, camera, pixel);
    if (!target) continue;
    const Camera nearer = zoom(camera, *target, 1.0);
    REQUIRE(glm::distance(pixel_of(nearer, *target), pixel) < 0.01);
    REQUIRE(glm::distance(nearer.eye.xyz, target->xyz) ==
            doctest::Approx(0.9 * glm::distance(camera.eye.xyz, target->xyz)).epsilon(1e-6));
    Camera there = camera;
    for (int step = 0; step < 20; ++step) there = zoom(there, *target, 1.0);
    for (int step = 0; step < 20; ++step) there = zoom(there, *target, -1.0);
    REQUIRE(glm::distance(there.eye.xyz, camera.eye.xyz) < 1e-6);
    REQUIRE(there.axes == camera.axes);
  }
}

TEST_CASE("orbit: keeps the pivot's pixel and distance") {
  CAPTURE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 5000; ++i) {
    const Camera camera = random_camera(random);
    const glm::dvec2 pixel = random_pixel(random);
    const auto pivot = pick(kBareGround, camera, pixel);
    if (!pivot) continue;
    const Camera turned = orbit(kWgs84, camera, *pivot, Radians(kPi * unit(random)), Radians(unit(random)));
    REQUIRE(glm::distance(pixel_of(turned, *pivot), pixel) < 0.01);
    REQUIRE(glm::distance(turned.eye.xyz, pivot->xyz) ==
            doctest::Approx(glm::distance(camera.eye.xyz, pivot->xyz)).epsilon(1e-7));
    check_orthonormal(turned);
  }
}

TEST_CASE("orbit: adds to heading and pitch, and stops straight down and just above level") {
  const Camera camera = camera_at("46,8,5000,0,-90");
  const Point<Ecef> pivot = *pick(kBareGround, camera, {640.0, 360.0});
  const glm::dvec3 up = normal_at(place_of(to_geodetic(kWgs84, pivot))).xyz;
  const auto pitch_at_pivot = [&](const Camera& c) {
    return degrees(Radians(std::asin(glm::dot(c.forward().xyz, up))));
  };
  const Camera tilted = orbit(kWgs84, camera, pivot, Radians(0.0), to_radians(Degrees(60.0)));
  CHECK(pitch_at_pivot(tilted) == doctest::Approx(-30.0));
  CHECK(pose_of(kWgs84, tilted).position.latitude < to_radians(Degrees(46.0)));  // the eye swings to the south
  const Pose turned = pose_of(kWgs84, orbit(kWgs84, camera, pivot, to_radians(Degrees(40.0)), Radians(0.0)));
  CHECK(degrees(turned.heading) == doctest::Approx(40.0).epsilon(1e-6));
  const Camera deep = orbit(kWgs84, camera, pivot, Radians(0.0), Radians(-1.0));
  CHECK(glm::distance(deep.forward().xyz, camera.forward().xyz) < 1e-12);
  const Camera high = orbit(kWgs84, camera, pivot, Radians(0.0), Radians(3.0));
  CHECK(pitch_at_pivot(high) == doctest::Approx(5.0));
}

TEST_CASE("orbit: there and back is where it began") {
  const Camera camera = camera_at("46,8,5000,20,-40");
  const Point<Ecef> pivot = *pick(kBareGround, camera, {300.0, 500.0});
  Camera there = orbit(kWgs84, camera, pivot, Radians(0.4), Radians(0.0));
  there = orbit(kWgs84, there, pivot, Radians(0.0), Radians(0.3));
  there = orbit(kWgs84, there, pivot, Radians(0.0), Radians(-0.3));
  there = orbit(kWgs84, there, pivot, Radians(-0.4), Radians(0.0));
  CHECK(glm::distance(there.eye.xyz, camera.eye.xyz) < 1e-5);
  CHECK(glm::distance(there.axes[2], camera.axes[2]) < 1e-9);
}

TEST_CASE("look_around: turns in place, up to straight up and down") {
  const Camera camera = camera_at("46,8,5000,350,-40,7");
  const Camera turned = look_around(kWgs84, camera, to_radians(Degrees(20.0)), to_radians(Degrees(15.0)));
  const Pose pose = pose_of(kWgs84, turned);
  CHECK(turned.eye == camera.eye);
  CHECK(degrees(pose.heading) == doctest::Approx(10.0));
  CHECK(degrees(pose.pitch) == doctest::Approx(-25.0));
  CHECK(degrees(pose.roll) == doctest::Approx(7.0));
  CHECK(degrees(pose_of(kWgs84, look_around(kWgs84, camera, Radians(0.0), Radians(9.0))).pitch) ==
        doctest::Approx(90.0));
  CHECK(degrees(pose_of(kWgs84, look_around(kWgs84, camera, Radians(0.0), Radians(-9.0))).pitch) ==
        doctest::Approx(-90.0));
}

TEST_CASE("north_up: levels the horizon and turns north, in place") {
  const Camera camera = camera_at("46,8,5000,123,-40,17");
  const Camera turned = north_up(kWgs84, camera);
  const Pose pose = pose_of(kWgs84, turned);
  CHECK(turned.eye == camera.eye);
  CHECK(std::abs(pose.heading.value) < 1e-12);
  CHECK(std::abs(pose.roll.value) < 1e-12);
  CHECK(degrees(pose.pitch) == doctest::Approx(-40.0));
}

TEST_CASE("fly: covers one clearance a second, level and around the planet") {
  const Camera start = camera_at("0,0,50000,90,0");
  Camera camera = start;
  for (int i = 0; i < 1000; ++i) camera = fly(kBareGround, camera, {0.0, 0.0, 1.0}, 0.1);
  const Pose pose = pose_of(kWgs84, camera);
  CHECK(pose.position.height.value == doctest::Approx(50000.0).epsilon(1e-6));
  CHECK(std::abs(degrees(pose.position.latitude)) < 1e-6);
  // 1000 x 0.1 s at 50 km/s, seen from the centre at a + 50 km.
  CHECK(degrees(pose.position.longitude) ==
        doctest::Approx(to_degrees(Radians(5e6 / (kWgs84.a() + 5e4))).value).epsilon(1e-4));
  CHECK(degrees(pose.heading) == doctest::Approx(90.0).epsilon(1e-6));
  CHECK(std::abs(degrees(pose.pitch)) < 1e-6);
  CHECK(std::abs(degrees(pose.roll)) < 1e-6);
}

TEST_CASE("fly: crosses the pole straight on; creeps near the ground; climbs straight up") {
  Camera camera = camera_at("89.9,30,10000,0,-10");
  for (int i = 0; i < 40; ++i) camera = fly(kBareGround, camera, {0.0, 0.0, 1.0}, 0.05);
  CHECK(degrees(pose_of(kWgs84, camera).position.longitude) == doctest::Approx(-150.0).epsilon(1e-6));
  const Plateau plateau(3000.0);
  const Camera low = camera_at("46,8,3000.5,0,0");
  const Camera crept = fly({kWgs84, &plateau}, low, {1.0, 0.0, 0.0}, 1.0);
  CHECK(glm::distance(crept.eye.xyz, low.eye.xyz) == doctest::Approx(2.0).epsilon(1e-6));
  CHECK(height_of(fly(kBareGround, camera_at("46,8,1000,0,0"), {0.0, 1.0, 0.0}, 0.5)) == doctest::Approx(1500.0));
}

TEST_CASE("keep_above: lifts straight up, and only where needed") {
  const Plateau plateau(3000.0);
  const Ground ground{kWgs84, &plateau};
  const Camera below = camera_at("46,8,2990,40,-5");
  const Camera lifted = keep_above(ground, below, Metres(2.0));
  CHECK(clearance_of(ground, lifted) == doctest::Approx(2.0).epsilon(1e-6));
  CHECK(lifted.axes == below.axes);
  CHECK(degrees(pose_of(kWgs84, lifted).position.latitude) == doctest::Approx(46.0).epsilon(1e-12));
  const Camera above = camera_at("46,8,3002.5");
  CHECK(keep_above(ground, above, Metres(2.0)).eye == above.eye);
}

TEST_CASE("home: shows the whole planet, large") {
  for (const auto& [width, height] : {std::pair{1280, 720}, std::pair{400, 900}}) {
    const Camera camera = home(kMars, Radians(1.0), to_radians(Degrees(45.0)), width, height);
    const glm::dvec2 middle(width / 2.0, height / 2.0);
    const double half = std::min(width, height) / 2.0;
    const Ground mars{kMars};
    for (int i = 0; i < 16; ++i) {
      const glm::dvec2 direction(std::cos(i * kPi / 8.0), std::sin(i * kPi / 8.0));
      CHECK(pick(mars, camera, middle + direction * (0.8 * half)));
      CHECK_FALSE(pick(mars, camera, middle + direction * (0.9 * half)));
    }
  }
}
