#include "view/flight.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "view/motion.h"

using namespace tellurion;
using namespace tellurion::geo;
using namespace tellurion::view;

namespace {

constexpr const char* kHeader = "time,lat,lon,height,heading,pitch,roll\n";

FlightSample sample(double time_s, const std::string& pose) { return {time_s, parse_pose(pose).value()}; }

Flight flight(std::vector<FlightSample> samples) { return Flight::create(std::move(samples)).value(); }

Camera camera_of(const Pose& pose) { return make_camera(kWgs84, pose, Radians(0.8), 1280, 720); }

double distance(const Pose& a, const Pose& b) { return glm::distance(camera_of(a).eye.xyz, camera_of(b).eye.xyz); }

/// Angle between two attitudes, by the farthest moved axis.
double turn(const Pose& a, const Pose& b) {
  const glm::dmat3 m = axes_of(a), n = axes_of(b);
  return std::max({glm::distance(m[0], n[0]), glm::distance(m[1], n[1]), glm::distance(m[2], n[2])});
}

std::string error_of(const std::string& text) {
  const Result<Flight> result = parse_flight(text, "f.csv");
  REQUIRE_FALSE(result);
  CHECK(result.error().code == ErrorCode::corrupt);
  return result.error().message;
}

}  // namespace

TEST_CASE("Flight: passes through its samples and stays at its ends") {
  const Flight way = flight({sample(0.0, "46,7,3000,0,-10"), sample(2.0, "46.1,7.2,3500,20,-12,3"),
                             sample(5.0, "46.2,7.1,2500,-30,-20"), sample(6.0, "46.3,7.1,2600,-30,-20")});
  for (const FlightSample& s : way.samples()) {
    CHECK(distance(way.pose_at(s.time_s), s.pose) < 1e-8);
    CHECK(distance(way.pose_at(s.time_s + 1e-9), s.pose) < 1e-3);
    CHECK(distance(way.pose_at(s.time_s - 1e-9), s.pose) < 1e-3);
    CHECK(turn(way.pose_at(s.time_s + 1e-9), s.pose) < 1e-6);
    CHECK(turn(way.pose_at(s.time_s - 1e-9), s.pose) < 1e-6);
  }
  CHECK(distance(way.pose_at(-5.0), way.samples().front().pose) == 0.0);
  CHECK(distance(way.pose_at(99.0), way.samples().back().pose) == 0.0);
  CHECK(way.start_s() == 0.0);
  CHECK(way.end_s() == 6.0);
}

TEST_CASE("Flight: velocity is continuous at the samples") {
  const Flight way = flight({sample(0.0, "80,170,30000,0,-10"), sample(2.0, "85,-175,35000,20,-12,3"),
                             sample(5.0, "89,-100,25000,80,-20"), sample(6.0, "88,20,26000,200,-20"),
                             sample(9.0, "84,40,24000,220,-25")});
  constexpr double kStep = 1e-4;
  for (std::size_t i = 1; i + 1 < way.samples().size(); ++i) {
    const double t = way.samples()[i].time_s;
    const auto eye = [&](double at) { return camera_of(way.pose_at(at)).eye.xyz; };
    const glm::dvec3 before = (eye(t) - eye(t - kStep)) / kStep, after = (eye(t + kStep) - eye(t)) / kStep;
    CHECK(glm::distance(before, after) < 1e-3 * glm::length(after));
    const auto forward = [&](double at) { return axes_of(way.pose_at(at))[2]; };
    const glm::dvec3 turn_before = (forward(t) - forward(t - kStep)) / kStep;
    const glm::dvec3 turn_after = (forward(t + kStep) - forward(t)) / kStep;
    CHECK(glm::distance(turn_before, turn_after) < 1e-3);
  }
}

TEST_CASE("Flight: goes straight over the pole and the antimeridian") {
  const Flight polar = flight({sample(0.0, "89,10,5000,0,0"), sample(10.0, "89,-170,5000,180,0")});
  const Pose middle = polar.pose_at(5.0);
  CHECK(to_degrees(middle.position.latitude).value == doctest::Approx(90.0).epsilon(1e-9));
  // Level flight along the meridian all the way: the attitude turns by the two degrees of the arc only.
  CHECK(turn(polar.pose_at(4.0), polar.pose_at(6.0)) < 0.01);
  const Flight pacific = flight({sample(0.0, "0,179,5000,90,0"), sample(10.0, "0,-179,5000,90,0")});
  CHECK(std::abs(to_degrees(pacific.pose_at(5.0).position.longitude).value) == doctest::Approx(180.0).epsilon(1e-9));
  CHECK(to_degrees(pacific.pose_at(5.0).heading).value == doctest::Approx(90.0).epsilon(1e-9));
}

TEST_CASE("Flight: an even flight around the equator keeps its pace and attitude") {
  std::vector<FlightSample> samples;
  for (int i = 0; i <= 72; ++i)
    samples.push_back(sample(i * 10.0, "0," + std::to_string(5 * i - 180) + ",10000,90,-30"));
  const Flight way = flight(std::move(samples));
  for (double t = 20.0; t < 700.0; t += 1.7) {
    const Pose pose = way.pose_at(t);
    CHECK(std::abs(std::remainder(to_degrees(pose.position.longitude).value - (t * 0.5 - 180.0), 360.0)) < 1e-3);
    CHECK(pose.position.height.value == doctest::Approx(10000.0).epsilon(1e-12));
    CHECK(to_degrees(pose.heading).value == doctest::Approx(90.0).epsilon(1e-4));
    CHECK(to_degrees(pose.pitch).value == doctest::Approx(-30.0).epsilon(1e-4));
  }
}

TEST_CASE("Flight: rests where samples rest, and heights stay between their neighbours") {
  const Flight way = flight({sample(0.0, "46,7,3000"), sample(1.0, "46,7,3000"), sample(2.0, "46.5,7,3000"),
                             sample(2.1, "46.6,7,100"), sample(9.0, "46.7,7,90"), sample(10.0, "46.7,7,4000")});
  for (double t = 0.0; t <= 1.0; t += 0.05) CHECK(distance(way.pose_at(t), way.samples()[0].pose) < 1e-8);
  for (double t = 0.0; t <= 10.0; t += 0.01) {
    const auto next = std::ranges::upper_bound(way.samples(), t, {}, &FlightSample::time_s);
    if (next == way.samples().end()) break;
    const double a = (next - 1)->pose.position.height.value, b = next->pose.position.height.value;
    const double height = way.pose_at(t).position.height.value;
    REQUIRE(height >= std::min(a, b) - 1e-9);
    REQUIRE(height <= std::max(a, b) + 1e-9);
  }
}

TEST_CASE("Flight: takes the short way round in heading") {
  const Flight way = flight({sample(0.0, "10,10,1000,350,-20"), sample(1.0, "10,10,1000,10,-20")});
  CHECK(std::abs(to_degrees(way.pose_at(0.5).heading).value) < 1e-6);
}

TEST_CASE("Flight: refuses nothing at all, standing time and jumps through the planet") {
  CHECK_FALSE(Flight::create({}));
  CHECK_FALSE(Flight::create({sample(1.0, "0,0,0"), sample(1.0, "1,0,0")}));
  const Result<Flight> jump = Flight::create({sample(0.0, "0,0,0"), sample(1.0, "0,179,0")});
  REQUIRE_FALSE(jump);
  CHECK(jump.error().message.find("sample 2") != std::string::npos);
  CHECK(Flight::create({sample(1.0, "0,0,0")}).value().pose_at(3.0).position.height.value == 0.0);
}

TEST_CASE("parse_flight: reads what people and programs write") {
  const Result<Flight> unix_text =
      parse_flight(std::string(kHeader) + "0,46,7,3000,0,-10,0\n1.5, 46.1, 7.1, 3000, 0, -10, 0", "f");
  REQUIRE(unix_text);
  CHECK(unix_text->samples().size() == 2);
  CHECK(unix_text->end_s() == 1.5);
  const Result<Flight> windows_text =
      parse_flight("\xEF\xBB\xBFtime,lat,lon,height,heading,pitch,roll\r\n\r\n0,46,7,3000,0,-10,0\r\n", "f");
  REQUIRE(windows_text);
  CHECK(to_degrees(windows_text->samples()[0].pose.pitch).value == doctest::Approx(-10.0));
}

TEST_CASE("parse_flight: names file, line and column of every fault") {
  const std::string header = kHeader;
  CHECK(error_of("").starts_with("f.csv:1: the header is not"));
  CHECK(error_of("lat,lon\n").starts_with("f.csv:1: the header is not"));
  CHECK(error_of(header) == "f.csv:2: no samples after the header");
  CHECK(error_of(header + "0,46,7,3000,0,-10,0\n1,46,x7,3000,0,-10,0\n") == "f.csv:3: column lon: 'x7' is no number");
  CHECK(error_of(header + "0,46,7,3000,0,-10\n") == "f.csv:2: column roll is missing");
  CHECK(error_of(header + "0,46,7,3000,0,-10,\n") == "f.csv:2: column roll: '' is no number");
  CHECK(error_of(header + "0,46,7,3000,0,-10,0,5\n") == "f.csv:2: more than 7 columns");
  CHECK(error_of(header + "0,46,7,3000,0,-10,0,\n") == "f.csv:2: more than 7 columns");
  CHECK(error_of(header + "\n0,95,7,3000,0,-10,0\n") == "f.csv:3: column lat: 95 is beyond 90");
  CHECK(error_of(header + "0,46,7,nan,0,-10,0\n") == "f.csv:2: column height: 'nan' is no number");
  CHECK(error_of(header + "1,0,0,0,0,0,0\n1,0,0,0,0,0,0\n") ==
        "f.csv:3: column time: not at least 1e-6 s later than the line before");
  CHECK(error_of(header + "0,0,0,0,0,0,0\n1,0,180,0,0,0,0\n").starts_with("f.csv: flight: sample 2"));
}

TEST_CASE("format_flight: reads back as the same flight") {
  const unsigned seed = 11;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::vector<FlightSample> samples;
  for (int i = 0; i < 500; ++i) samples.push_back({i * 0.25 + 1e-6, pose_of(kWgs84, random_camera(random))});
  const Result<Flight> back = parse_flight(format_flight(samples), "f");
  if (!back) CHECK(back.error().message.find("other side") != std::string::npos);
  for (const FlightSample& s : samples) {
    const Result<Flight> single = parse_flight(format_flight({&s, 1}), "f");
    REQUIRE(single);
    REQUIRE(std::abs(single->start_s() - s.time_s) < 1e-6);
    REQUIRE(distance(single->samples()[0].pose, s.pose) < 2e-5 + 1e-12 * s.pose.position.height.value);
    REQUIRE(turn(single->samples()[0].pose, s.pose) < 1e-10);
  }
}

TEST_CASE("read_flight and write_flight: go through a file, and name one that is missing") {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "tellurion_flight_test.csv";
  const std::vector<FlightSample> samples{sample(0.0, "46,7,3000"), sample(2.0, "46.1,7.2,3500")};
  REQUIRE(write_flight(path, samples));
  const Result<Flight> back = read_flight(path);
  REQUIRE(back);
  CHECK(back->samples().size() == 2);
  std::filesystem::remove(path);
  const Result<Flight> missing = read_flight(path);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ErrorCode::not_found);
  CHECK(missing.error().message.find(path.string()) != std::string::npos);
  CHECK_FALSE(write_flight("/nowhere/at/all.csv", samples));
}
