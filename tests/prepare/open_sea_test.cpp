#include "prepare/open_sea.h"

#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::prepare;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr geo::Ellipsoid kBall{Metres(6'371'000.0), Metres(6'371'000.0)};

geo::LatLon at(double latitude, double longitude) { return {Radians(latitude * kDegree), Radians(longitude * kDegree)}; }

Ring ring_of(const std::vector<std::pair<double, double>>& places) {
  Ring ring;
  for (const auto& [latitude, longitude] : places) ring.push_back(at(latitude, longitude));
  return ring;
}

/// Metres over ground on the ball.
double way(const geo::LatLon& a, const geo::LatLon& b) {
  const double up = std::sin((a.latitude - b.latitude).value / 2.0), right = std::sin((a.longitude - b.longitude).value / 2.0);
  return 2.0 * kBall.a() * std::asin(std::sqrt(up * up + std::cos(a.latitude.value) * std::cos(b.latitude.value) * right * right));
}

/// The whole body, `side` pixels to a degree.
PlaceOfPixel whole_body(double side) {
  return [side](double x, double y) -> std::optional<geo::LatLon> { return at(90.0 - y / side, -180.0 + x / side); };
}

geo::Point<geo::Ecef> point(const geo::LatLon& place) { return geo::surface_point(kBall, geo::normal_at(place)); }

}  // namespace

TEST_CASE("Shore: land is within, islands in lakes too, and past the 180th meridian") {
  const Shore shore(kBall, {{ring_of({{0, 0}, {0, 30}, {30, 30}, {30, 0}}), ring_of({{10, 10}, {10, 20}, {20, 20}, {20, 10}}), ring_of({{14, 14}, {14, 16}, {16, 16}, {16, 14}}),
                            ring_of({{-20, 170}, {-20, 190}, {-10, 190}, {-10, 170}})},
                            {ring_of({{-15, 178}, {-15, 200}, {-14, 200}, {-14, 178}})}});
  CHECK(shore.is_land(at(5, 5)));
  CHECK_FALSE(shore.is_land(at(12, 12)));
  CHECK(shore.is_land(at(15, 15)));
  CHECK_FALSE(shore.is_land(at(5, -5)));
  CHECK(shore.is_land(at(-15, 179)));
  CHECK(shore.is_land(at(-15, -175)));
  CHECK_FALSE(shore.is_land(at(-15, -155)));
  CHECK(shore.is_land(at(-14.5, 179)));  // of two lands
  CHECK(shore.is_land(at(-14.5, -165)));  // of the second alone
}

TEST_CASE("Shore: distances are those to the nearest point of the coast") {
  const Shore shore(kBall, {{ring_of({{-1, -1}, {-1, 1}, {1, 1}, {1, -1}})}});
  CHECK(shore.distance(point(at(0, 3)), 1e7) == doctest::Approx(2.0 * kBall.a() * std::sin(kDegree)).epsilon(1e-5));
  CHECK(shore.distance(point(at(0, 0.5)), 1e7) == doctest::Approx(2.0 * kBall.a() * std::sin(0.25 * kDegree)).epsilon(1e-4));
  CHECK(shore.distance(point(at(0, 90)), 1000.0) == 1000.0);
}

TEST_CASE("Shore: where maps end there is no coast") {
  const Shore shore(kBall, {{ring_of({{-90, -180}, {-70, -180}, {-70, 180}, {-90, 180}})}});
  CHECK(shore.distance(point(at(-80, 180)), 1e7) > 1e6);
  CHECK(shore.is_land(at(-89, 179.9)));
}

TEST_CASE("open_sea: every pixel as its own distance says, poles and date line too") {
  const Land land{ring_of({{60, -10}, {60, 10}, {85, 10}, {85, -10}}), ring_of({{-5, 175}, {-5, 185}, {5, 185}, {5, 175}}), ring_of({{-90, -180}, {-75, -180}, {-75, 180}, {-90, 180}})};
  const Shore shore(kBall, {land});
  std::vector<geo::LatLon> coast;
  for (int i = 0; i <= 2000; ++i) {
    const double share = i / 2000.0;
    for (const double longitude : {-10.0, 10.0}) coast.push_back(at(60.0 + 25.0 * share, longitude));
    for (const double latitude : {60.0, 85.0}) coast.push_back(at(latitude, -10.0 + 20.0 * share));
    for (const double longitude : {175.0, 185.0}) coast.push_back(at(-5.0 + 10.0 * share, longitude));
    for (const double latitude : {-5.0, 5.0}) coast.push_back(at(latitude, 175.0 + 10.0 * share));
    coast.push_back(at(-75.0, -180.0 + 360.0 * share));
  }
  constexpr double kMetres = 700e3, kTolerance = 2000.0;  // between the points above
  const PlaceOfPixel place = whole_body(0.25);
  const auto found = open_sea(shore, place, {0, 0, 90, 45}, kMetres);
  int compared = 0;
  for (int y = 0; y < 45; ++y) {
    for (int x = 0; x < 90; ++x) {
      const geo::LatLon here = *place(x + 0.5, y + 0.5);
      double least = 1e9;
      for (const geo::LatLon& one : coast) least = std::min(least, way(here, one));
      if (std::abs(least - kMetres) < kTolerance) continue;
      const bool far = least > kMetres && !shore.is_land(here);
      CAPTURE(here.latitude.value / kDegree);
      CAPTURE(here.longitude.value / kDegree);
      CHECK((found[static_cast<std::size_t>(y) * 90 + static_cast<std::size_t>(x)] != 0) == far);
      ++compared;
    }
  }
  CHECK(compared > 3900);
}

TEST_CASE("open_sea: parts of a raster give what the whole gives, and pixels that lie nowhere stay") {
  const Shore shore(kBall, {{ring_of({{10, 10}, {12, 40}, {30, 35}, {25, 5}})}});
  const PlaceOfPixel whole = whole_body(2.0);
  const PlaceOfPixel place = [&](double x, double y) { return x < 20.0 ? std::nullopt : whole(x, y); };
  const auto found = open_sea(shore, place, {0, 0, 720, 360}, 300e3);
  const auto part = open_sea(shore, place, {361, 97, 101, 93}, 300e3);
  for (int y = 0; y < 93; ++y) {
    for (int x = 0; x < 101; ++x) CHECK(part[static_cast<std::size_t>(y * 101 + x)] == found[static_cast<std::size_t>((97 + y) * 720 + 361 + x)]);
  }
  CHECK(found[10] == 0);
  CHECK(found[30] == 1);
}
