#include "source/catalogue/footprint.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace tellurion::source {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFacePerRadian = 4.0 / kPi;  ///< face coordinates

/// A cap's cosine knows small angles to this only.
constexpr double kAngleSlack = 3e-8;

/// A ring round more is not told from its outside: the data set counts as the whole body.
constexpr double kLargestCap = 1.4;

double angle_between(const glm::dvec3& a, const glm::dvec3& b) { return 2.0 * std::asin(std::min(1.0, glm::length(a - b) / 2.0)); }

bool overlap(const geo::FaceRect& a, const geo::FaceRect& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y && b.lower.y <= a.upper.y;
}

geo::FaceRect grown(const geo::FaceRect& rect, double margin) { return {rect.lower - margin, rect.upper + margin}; }

bool holds(const geo::FaceRect& rect, glm::dvec2 p) {
  return p.x >= rect.lower.x && p.x <= rect.upper.x && p.y >= rect.lower.y && p.y <= rect.upper.y;
}

/// By crossings of a ray along x.
bool is_inside(std::span<const glm::dvec2> ring, glm::dvec2 p) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const glm::dvec2 a = ring[i], b = ring[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) inside = !inside;
  }
  return inside;
}

/// Whether the segment meets the rectangle (slabs).
bool crosses(const geo::FaceRect& rect, glm::dvec2 a, glm::dvec2 b) {
  double enter = 0.0, leave = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double step = b[axis] - a[axis];
    if (step == 0.0) {
      if (a[axis] < rect.lower[axis] || a[axis] > rect.upper[axis]) return false;
      continue;
    }
    const double first = (rect.lower[axis] - a[axis]) / step, second = (rect.upper[axis] - a[axis]) / step;
    enter = std::max(enter, std::min(first, second));
    leave = std::min(leave, std::max(first, second));
  }
  return enter <= leave;
}

/// How far the outline leaves the straight lines between its places, on the safe side. Places of odd number lie within an edge: an
/// arc over two steps is four times as high as over one.
double bulge_of(std::span<const glm::dvec2> ring) {
  double most = 0.0;
  for (std::size_t i = 1; i < ring.size(); i += 2) {
    const glm::dvec2 middle = (ring[i - 1] + ring[(i + 1) % ring.size()]) / 2.0;
    most = std::max(most, glm::length(ring[i] - middle));
  }
  return most / 2.0;
}

}  // namespace

SphereCap cap_of(const glm::dvec3& middle, Radians radius) {
  if (radius.value >= kPi) return {middle, -1.0, 0.0};
  return {middle, std::cos(radius.value), std::sin(radius.value)};
}

bool overlap(const SphereCap& a, const SphereCap& b) {
  if (a.cosine <= -b.cosine) return true;  // their radii make half a turn
  return glm::dot(a.middle, b.middle) >= a.cosine * b.cosine - a.sine * b.sine;
}

FaceRegion region_of(int face, const geo::FaceRect& rect) {
  const glm::dvec3 middle = geo::face_normal(face, (rect.lower + rect.upper) / 2.0).xyz;
  // The rectangle's sides lie on great circles: nothing of it is farther from its middle than its corners.
  double radius = 0.0;
  for (const glm::dvec2& corner : {rect.lower, glm::dvec2(rect.upper.x, rect.lower.y), rect.upper, glm::dvec2(rect.lower.x, rect.upper.y)}) {
    radius = std::max(radius, angle_between(middle, geo::face_normal(face, corner).xyz));
  }
  return {face, rect, cap_of(middle, Radians(radius + kAngleSlack))};
}

FaceRegion region_of(const geo::TileKey& tile) { return region_of(tile.face, geo::face_rect(tile)); }

Footprint::Footprint(std::span<const geo::LatLon> ring, Metres spacing, const geo::Ellipsoid& world)
    : extent_(2.0 * kPi), spacing_(spacing) {
  assert(ring.size() >= 4 && spacing.value > 0.0);
  std::vector<geo::Vector<geo::Ecef>> normals(ring.size());
  std::transform(ring.begin(), ring.end(), normals.begin(), geo::normal_at);
  glm::dvec3 sum(0.0);
  for (const auto& normal : normals) sum += normal.xyz;
  const double length = glm::length(sum);
  if (length < 1e-6 * static_cast<double>(ring.size())) return;
  const glm::dvec3 middle = sum / length;
  double radius = 0.0, longest_step = 0.0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    radius = std::max(radius, angle_between(middle, normals[i].xyz));
    longest_step = std::max(longest_step, angle_between(normals[i].xyz, normals[(i + 1) % normals.size()].xyz));
  }
  // Data reach a sample beyond their border, where they fade.
  const double beyond = 2.0 * spacing.value / world.b();
  radius += longest_step / 8.0 + beyond + kAngleSlack;  // an arc of a step is less than an eighth of it high
  if (!(radius <= kLargestCap)) return;
  cap_ = cap_of(middle, Radians(radius));
  extent_ = Radians(2.0 * radius);

  for (int face = 0; face < geo::kFaceCount; ++face) {
    if (!overlap(cap_, region_of({static_cast<std::uint8_t>(face), 0, 0, 0}).cap)) continue;
    OnFace on;
    on.face = face;
    on.rect = {glm::dvec2(std::numeric_limits<double>::infinity()), glm::dvec2(-std::numeric_limits<double>::infinity())};
    for (const auto& normal : normals) {
      const std::optional<glm::dvec2> at = geo::project_to_face(face, normal);
      if (!at) break;
      on.ring.push_back(*at);
      on.rect = {glm::min(on.rect.lower, *at), glm::max(on.rect.upper, *at)};
    }
    if (on.ring.size() < normals.size()) {
      on.ring.clear();
      on.rect = {glm::dvec2(-2.0), glm::dvec2(2.0)};
    } else {
      on.margin = bulge_of(on.ring) + beyond * kFacePerRadian;
      on.rect = grown(on.rect, on.margin);
    }
    on_faces_.push_back(std::move(on));
  }
}

bool Footprint::touches(const FaceRegion& region) const {
  if (!overlap(cap_, region.cap)) return false;
  if (on_faces_.empty()) return true;
  const auto on = std::ranges::find(on_faces_, region.face, &OnFace::face);
  if (on == on_faces_.end() || !overlap(on->rect, region.rect)) return false;
  if (on->ring.empty()) return true;
  const geo::FaceRect rect = grown(region.rect, on->margin);
  if (is_inside(on->ring, rect.lower)) return true;
  for (std::size_t i = 0, j = on->ring.size() - 1; i < on->ring.size(); j = i++) {
    if (holds(rect, on->ring[i]) || crosses(rect, on->ring[j], on->ring[i])) return true;
  }
  return false;
}

Metres Footprint::spacing_under(const geo::TileKey& tile) const {
  return touches(tile) ? spacing_ : Metres(std::numeric_limits<double>::infinity());
}

std::vector<geo::LatLon> ring_of_raster(RasterReader& reader, const LevelSize& size) {
  const std::array<glm::dvec2, 4> corners{glm::dvec2(0.0), glm::dvec2(size.width, 0.0), glm::dvec2(size.width, size.height), glm::dvec2(0.0, size.height)};
  std::vector<glm::dvec2> pixels;
  for (std::size_t edge = 0; edge < 4; ++edge) {
    for (int i = 0; i < kRingSteps; ++i) pixels.push_back(glm::mix(corners[edge], corners[(edge + 1) % 4], static_cast<double>(i) / kRingSteps));
  }
  std::vector<geo::LatLon> ring(pixels.size());
  reader.to_places(pixels, ring);
  const bool complete = std::ranges::all_of(ring, [](const geo::LatLon& p) { return std::isfinite(p.latitude.value) && std::isfinite(p.longitude.value); });
  if (!complete) ring.clear();
  return ring;
}

}  // namespace tellurion::source
