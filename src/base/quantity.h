// Numbers whose unit is part of their type.
// Zero-cost: one double; no implicit conversion from or to plain numbers.
#pragma once

#include <compare>
#include <numbers>

namespace tellurion {

/// A double that carries the unit `Unit`.
template <class Unit>
struct Quantity {
  double value = 0.0;

  constexpr Quantity() = default;
  constexpr explicit Quantity(double v) : value(v) {}

  friend constexpr auto operator<=>(Quantity, Quantity) = default;
  friend constexpr Quantity operator+(Quantity a, Quantity b) { return Quantity(a.value + b.value); }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return Quantity(a.value - b.value); }
  friend constexpr Quantity operator-(Quantity a) { return Quantity(-a.value); }
  friend constexpr Quantity operator*(Quantity a, double s) { return Quantity(a.value * s); }
  friend constexpr Quantity operator*(double s, Quantity a) { return Quantity(s * a.value); }
  friend constexpr Quantity operator/(Quantity a, double s) { return Quantity(a.value / s); }
  friend constexpr double operator/(Quantity a, Quantity b) { return a.value / b.value; }
  constexpr Quantity& operator+=(Quantity b) {
    value += b.value;
    return *this;
  }
  constexpr Quantity& operator-=(Quantity b) {
    value -= b.value;
    return *this;
  }
};

using Metres = Quantity<struct MetresUnit>;
using Pixels = Quantity<struct PixelsUnit>;
using Radians = Quantity<struct RadiansUnit>;
using Degrees = Quantity<struct DegreesUnit>;

constexpr Radians to_radians(Degrees d) { return Radians(d.value * (std::numbers::pi / 180.0)); }
constexpr Degrees to_degrees(Radians r) { return Degrees(r.value * (180.0 / std::numbers::pi)); }

/// Heights above three different surfaces; none converts to another by accident.
using EllipsoidalHeight = Quantity<struct EllipsoidalHeightUnit>;  ///< metres above the ellipsoid
using GeoidHeight = Quantity<struct GeoidHeightUnit>;              ///< metres above mean sea level
using PressureAltitude = Quantity<struct PressureAltitudeUnit>;    ///< metres in the standard atmosphere

inline namespace literals {
constexpr Metres operator""_m(long double v) { return Metres(static_cast<double>(v)); }
constexpr Metres operator""_m(unsigned long long v) { return Metres(static_cast<double>(v)); }
constexpr Degrees operator""_deg(long double v) { return Degrees(static_cast<double>(v)); }
constexpr Degrees operator""_deg(unsigned long long v) { return Degrees(static_cast<double>(v)); }
}  // namespace literals

}  // namespace tellurion
