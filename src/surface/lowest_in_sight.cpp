#include "surface/lowest_in_sight.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace tellurion::surface {
namespace {

constexpr int kMostRounds = 4;
constexpr int kFinestLevel = 2 * kOutlookLevels;  ///< tiles of 160 km on Earth
constexpr double kTilesOfAngle = 4;               ///< a cap is looked at by tiles of about its angle over this
constexpr double kSlack = 0.002;                  ///< radians: great heights do not lie where their normal meets the ellipsoid

/// Ground round the eye, in the space where the ellipsoid is the unit sphere.
struct Cap {
  glm::dvec3 radii{1.0};     ///< of the ellipsoid: a normal times these points to its place
  glm::dvec3 direction{0.0}; ///< of the eye
  double angle = 0;          ///< radians
};

bool touches(const Cap& cap, const TileShape& shape) {
  const double cosine = glm::dot(glm::normalize(shape.up * cap.radii), cap.direction);
  return std::acos(std::clamp(cosine, -1.0, 1.0)) <= cap.angle + shape.cone * cap.radii.x / cap.radii.z + kSlack;
}

/// Whether lines of sight may meet a lowered ellipsoid there.
bool is_in_picture(const NodePool& pool, const SelectionFrame& frame, Node& node, double lowest, double highest) {
  if (lowest != node.column_lowest || highest != node.column_highest) {
    node.column = tile_box(pool.ellipsoid(), node.key, lowest, highest);
    node.column_lowest = lowest;
    node.column_highest = highest;
  }
  return planes_crossed(frame.volume, node.column, kAllPlanes).has_value();
}

/// Takes no node's own range: whether it was built is chance.
void lower(NodePool& pool, const SelectionFrame& frame, const Cap& cap, Node& node, double& lowest) {
  node.sighted = frame.number;
  const Outlook::Block* const outlook = node.facts.assumed ? foretold(node) : nullptr;
  const double own_lowest = frame.settings.exaggeration * static_cast<double>(outlook != nullptr ? outlook->min_height : node.facts.min_height);
  const double own_highest = frame.settings.exaggeration * static_cast<double>(outlook != nullptr ? outlook->max_height : node.facts.max_height);
  if (own_lowest >= lowest || !touches(cap, node.shape) || !is_in_picture(pool, frame, node, own_lowest, std::max(own_highest, 0.0))) return;
  if (node.key.level == kFinestLevel || node.shape.cone * kTilesOfAngle < cap.angle) {
    lowest = own_lowest;
    return;
  }
  pool.add_children(node);
  for (int i = 0; i < 4; ++i) lower(pool, frame, cap, node.children[i], lowest);
}

}  // namespace

double lowest_in_sight(NodePool& pool, const SelectionFrame& frame) {
  const geo::Ellipsoid& ellipsoid = pool.ellipsoid();
  const glm::dvec3 radii(ellipsoid.a(), ellipsoid.a(), ellipsoid.b());
  const glm::dvec3 eye = frame.volume.eye / radii;
  Cap cap{radii, glm::normalize(eye), 0};
  double lowest = frame.lowest;
  for (int round = 0; round < kMostRounds; ++round) {
    const double cosine = (1 + lowest / ellipsoid.b()) / glm::length(eye);
    if (cosine <= 0 || cosine >= 1) break;
    cap.angle = std::acos(cosine);
    double found = 0;
    for (Node& root : pool.roots()) lower(pool, frame, cap, root, found);
    if (found <= lowest) break;
    lowest = found;
  }
  return lowest;
}

}  // namespace tellurion::surface
