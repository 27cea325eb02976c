// Points, vectors and transforms that know their frame of reference.
// World positions are double; float exists only in TileLocal and CameraRelative.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace tellurion::geo {

struct Ecef {};            ///< Earth-centred, Earth-fixed (or body-centred); metres, z to the north pole, x to lon 0
struct Enu {};             ///< east, north, up at some place; metres
struct TileLocal {};       ///< Ecef axes, origin at a tile's own origin; metres
struct CameraRelative {};  ///< Ecef axes, origin at the eye; metres

/// A difference of positions, or a direction, in `Frame`.
template <class Frame>
struct Vector {
  glm::dvec3 xyz{0.0};

  friend constexpr bool operator==(const Vector&, const Vector&) = default;
  friend constexpr Vector operator+(const Vector& a, const Vector& b) { return {a.xyz + b.xyz}; }
  friend constexpr Vector operator-(const Vector& a, const Vector& b) { return {a.xyz - b.xyz}; }
  friend constexpr Vector operator-(const Vector& a) { return {-a.xyz}; }
  friend constexpr Vector operator*(const Vector& a, double s) { return {a.xyz * s}; }
  friend constexpr Vector operator*(double s, const Vector& a) { return {a.xyz * s}; }
};

/// A position in `Frame`.
template <class Frame>
struct Point {
  glm::dvec3 xyz{0.0};

  friend constexpr bool operator==(const Point&, const Point&) = default;
  friend constexpr Vector<Frame> operator-(const Point& a, const Point& b) { return {a.xyz - b.xyz}; }
  friend constexpr Point operator+(const Point& a, const Vector<Frame>& b) { return {a.xyz + b.xyz}; }
  friend constexpr Point operator-(const Point& a, const Vector<Frame>& b) { return {a.xyz - b.xyz}; }
};

/// A rigid motion from `From` to `To`: rotate, then translate.
template <class To, class From>
struct Transform {
  glm::dmat3 rotation{1.0};
  glm::dvec3 translation{0.0};

  Point<To> operator()(const Point<From>& p) const { return {rotation * p.xyz + translation}; }
  Vector<To> operator()(const Vector<From>& v) const { return {rotation * v.xyz}; }

  Transform<From, To> inverse() const {
    const glm::dmat3 back = glm::dmat3(rotation[0][0], rotation[1][0], rotation[2][0], rotation[0][1], rotation[1][1],
                                       rotation[2][1], rotation[0][2], rotation[1][2], rotation[2][2]);
    return {back, -(back * translation)};
  }
};

/// First `inner`, then `outer`.
template <class A, class B, class C>
Transform<A, C> operator*(const Transform<A, B>& outer, const Transform<B, C>& inner) {
  return {outer.rotation * inner.rotation, outer.rotation * inner.translation + outer.translation};
}

}  // namespace tellurion::geo
