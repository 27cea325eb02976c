#include "geo/body.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tellurion::geo {
namespace {

constexpr Ellipsoid sphere(double radius) { return {Metres(radius), Metres(radius)}; }

constexpr std::array kBodies{
    Body{"Earth", kWgs84},
    Body{"Moon", kMoon},
    Body{"Mars", kMars},
    Body{"Mercury", {Metres(2440530.0), Metres(2438260.0)}},
    Body{"Venus", sphere(6051800.0)},
    Body{"Jupiter", {Metres(71492000.0), Metres(66854000.0)}},
    Body{"Io", sphere(1821490.0)},
    Body{"Europa", sphere(1560800.0)},
    Body{"Ganymede", sphere(2631200.0)},
    Body{"Callisto", sphere(2410300.0)},
    Body{"Saturn", {Metres(60268000.0), Metres(54364000.0)}},
    Body{"Titan", sphere(2575000.0)},
    Body{"Uranus", {Metres(25559000.0), Metres(24973000.0)}},
    Body{"Neptune", {Metres(24764000.0), Metres(24341000.0)}},
    Body{"Triton", sphere(1352600.0)},
    Body{"Pluto", sphere(1188300.0)},
    Body{"Charon", sphere(606000.0)},
};

constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

std::span<const Body> bodies() { return kBodies; }

std::optional<Body> find_body(std::string_view name) {
  const auto same = [](char a, char b) { return lower(a) == lower(b); };
  for (const Body& body : kBodies) {
    if (std::ranges::equal(body.name, name, same)) return body;
  }
  return std::nullopt;
}

const Body* body_like(const Ellipsoid& ellipsoid) {
  const Body* best = nullptr;
  double least = 0.01;
  for (const Body& body : kBodies) {
    const double difference = std::abs(ellipsoid.a() / body.ellipsoid.a() - 1.0);
    if (difference < least) {
      least = difference;
      best = &body;
    }
  }
  return best;
}

}  // namespace tellurion::geo
