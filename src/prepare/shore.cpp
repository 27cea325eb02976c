#include "prepare/shore.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace tellurion::prepare {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kCutTolerance = 1e-9;           ///< radians
constexpr double kLongestStep = 0.05 * kPi / 180.0;  ///< radians: a straight line as long lies 0.6 m below the Earth's surface
constexpr std::size_t kRunSegments = 16;
constexpr std::size_t kBands = 2048;

std::size_t band_of(double latitude) {
  const double at = (latitude / kPi + 0.5) * static_cast<double>(kBands);
  return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(kBands - 1)));
}

/// Whether an edge only cuts land where maps end.
bool is_cut(const geo::LatLon& a, const geo::LatLon& b) {
  const auto both_at = [](Radians one, Radians other, double line) { return std::abs(one.value - line) < kCutTolerance && std::abs(other.value - line) < kCutTolerance; };
  return both_at(a.longitude, b.longitude, -kPi) || both_at(a.longitude, b.longitude, kPi) || both_at(a.latitude, b.latitude, -kPi / 2.0) || both_at(a.latitude, b.latitude, kPi / 2.0);
}

double square_to_segment(const glm::dvec3& from, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double length = glm::dot(along, along);
  const double share = length > 0.0 ? std::clamp(glm::dot(from - a, along) / length, 0.0, 1.0) : 0.0;
  const glm::dvec3 off = from - (a + share * along);
  return glm::dot(off, off);
}

double square_to_box(const glm::dvec3& from, const glm::dvec3& least, const glm::dvec3& most) {
  const glm::dvec3 off = glm::max(glm::max(least - from, from - most), glm::dvec3(0.0));
  return glm::dot(off, off);
}

}  // namespace

Shore::Shore(const geo::Ellipsoid& body, const std::vector<Land>& lands) : body_(body), bands_(kBands) {
  assert(lands.size() <= kMostLands);
  for (std::size_t land = 0; land < lands.size(); ++land) {
    for (const Ring& ring : lands[land]) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const geo::LatLon &a = ring[i], &b = ring[(i + 1) % ring.size()];
        add_edge({a.latitude.value, a.longitude.value, b.latitude.value, b.longitude.value, std::uint64_t{1} << land});
      }
      add_coast(ring);
    }
  }
  if (!leaves_.empty()) root_ = build(leaves_, 0, leaves_.size());
  leaves_ = {};
}

void Shore::add_edge(const Edge& edge) {
  if (edge.from_latitude == edge.to_latitude) return;
  const auto [south, north] = std::minmax(edge.from_latitude, edge.to_latitude);
  for (std::size_t band = band_of(south); band <= band_of(north); ++band) bands_[band].push_back(static_cast<std::uint32_t>(edges_.size()));
  edges_.push_back(edge);
}

void Shore::add_coast(const Ring& ring) {
  const auto point = [&](const geo::LatLon& place) { return geo::surface_point(body_, geo::normal_at(place)).xyz; };
  std::size_t first = points_.size();
  const auto end_run = [&] {
    if (points_.size() > first + 1) add_run(first, points_.size() - 1);
    first = points_.size();
  };
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const geo::LatLon &a = ring[i], &b = ring[(i + 1) % ring.size()];
    if (is_cut(a, b)) {
      end_run();
      continue;
    }
    const Radians up = b.latitude - a.latitude, right = b.longitude - a.longitude;
    const int steps = std::max(1, static_cast<int>(std::ceil(std::max(std::abs(up.value), std::abs(right.value)) / kLongestStep)));
    if (points_.size() == first) points_.push_back(point(a));
    for (int step = 1; step <= steps; ++step) {
      const double share = static_cast<double>(step) / steps;
      points_.push_back(point({a.latitude + up * share, a.longitude + right * share}));
      if (points_.size() - first <= kRunSegments) continue;
      add_run(first, points_.size() - 1);
      first = points_.size() - 1;
    }
  }
  end_run();
}

void Shore::add_run(std::size_t first, std::size_t last) {
  Node leaf;
  leaf.first = static_cast<std::uint32_t>(first);
  leaf.last = static_cast<std::uint32_t>(last);
  leaf.box = {points_[first], points_[first]};
  for (std::size_t i = first; i <= last; ++i) leaf.box = {glm::min(leaf.box.least, points_[i]), glm::max(leaf.box.most, points_[i])};
  leaves_.push_back(leaf);
}

std::uint32_t Shore::build(std::vector<Node>& leaves, std::size_t first, std::size_t last) {
  if (last - first == 1) {
    nodes_.push_back(leaves[first]);
    return static_cast<std::uint32_t>(nodes_.size() - 1);
  }
  Box box = leaves[first].box;
  for (std::size_t i = first; i < last; ++i) box = {glm::min(box.least, leaves[i].box.least), glm::max(box.most, leaves[i].box.most)};
  const glm::dvec3 size = box.most - box.least;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = (first + last) / 2;
  const auto at = [&](std::size_t i) { return leaves.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last), [axis](const Node& a, const Node& b) { return a.box.least[axis] + a.box.most[axis] < b.box.least[axis] + b.box.most[axis]; });
  Node node;
  node.box = box;
  node.left = build(leaves, first, middle);
  node.right = build(leaves, middle, last);
  nodes_.push_back(node);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

double Shore::distance(const geo::Point<geo::Ecef>& from, double most) const {
  return nodes_.empty() ? most : std::sqrt(nearest(root_, from.xyz, most * most));
}

double Shore::nearest(std::uint32_t index, const glm::dvec3& from, double best) const {
  const Node& node = nodes_[index];
  if (square_to_box(from, node.box.least, node.box.most) >= best) return best;
  if (node.first != node.last) {
    for (std::size_t i = node.first; i < node.last; ++i) best = std::min(best, square_to_segment(from, points_[i], points_[i + 1]));
    return best;
  }
  const auto square_to = [&](std::uint32_t child) { return square_to_box(from, nodes_[child].box.least, nodes_[child].box.most); };
  const bool left_first = square_to(node.left) <= square_to(node.right);
  best = nearest(left_first ? node.left : node.right, from, best);
  return nearest(left_first ? node.right : node.left, from, best);
}

bool Shore::is_land(const geo::LatLon& place) const {
  const double latitude = place.latitude.value, longitude = std::remainder(place.longitude.value, 2.0 * kPi);
  const auto odd_crossings_east_of = [&](double from) {
    std::uint64_t odd = 0;
    for (const std::uint32_t index : bands_[band_of(latitude)]) {
      const Edge& edge = edges_[index];
      if ((edge.from_latitude > latitude) == (edge.to_latitude > latitude)) continue;
      const double share = (latitude - edge.from_latitude) / (edge.to_latitude - edge.from_latitude);
      if (edge.from_longitude + share * (edge.to_longitude - edge.from_longitude) > from) odd ^= edge.land;
    }
    return odd;
  };
  for (const double turn : {0.0, 2.0 * kPi, -2.0 * kPi}) {  // rings may go past the 180th meridian
    if (odd_crossings_east_of(longitude + turn) != 0) return true;
  }
  return false;
}

std::size_t Shore::bytes() const {
  std::size_t bytes = edges_.capacity() * sizeof(Edge) + points_.capacity() * sizeof(glm::dvec3) + nodes_.capacity() * sizeof(Node);
  for (const auto& band : bands_) bytes += band.capacity() * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace tellurion::prepare
