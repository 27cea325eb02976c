// Land and its coast on a body: how far a place is from it, and on which side.
// Thread-safe once made: no call changes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geo/ellipsoid.h"

namespace tellurion::prepare {

/// A closed line without its first point again, straight in latitude and longitude.
using Ring = std::vector<geo::LatLon>;

/// Land is what lies within an odd number of rings: lakes are holes, and islands in them land again.
using Land = std::vector<Ring>;

class Shore {
 public:
  static constexpr std::size_t kMostLands = 64;

  /// All of `lands`, at most kMostLands, together. Edges on the 180th meridian or a pole cut land and are no coast.
  Shore(const geo::Ellipsoid& body, const std::vector<Land>& lands);

  /// Metres to the coast through the body; `most` if it is farther.
  double distance(const geo::Point<geo::Ecef>& from, double most) const;
  bool is_land(const geo::LatLon& place) const;
  const geo::Ellipsoid& body() const { return body_; }
  /// What it takes of memory.
  std::size_t bytes() const;

 private:
  struct Edge {
    double from_latitude, from_longitude, to_latitude, to_longitude;  ///< radians
    std::uint64_t land;  ///< a bit for each
  };
  struct Box {
    glm::dvec3 least, most;
  };
  /// A box of a binary tree over runs of the coast; a leaf holds the segments from point `first` to `last`.
  struct Node {
    Box box;
    std::uint32_t first = 0, last = 0;    ///< of leaves; equal: no leaf
    std::uint32_t left = 0, right = 0;
  };

  void add_edge(const Edge& edge);
  void add_coast(const Ring& ring);
  void add_run(std::size_t first, std::size_t last);
  std::uint32_t build(std::vector<Node>& leaves, std::size_t first, std::size_t last);
  double nearest(std::uint32_t node, const glm::dvec3& from, double best) const;

  geo::Ellipsoid body_;
  std::vector<Edge> edges_;
  std::vector<std::vector<std::uint32_t>> bands_;  ///< the edges that touch each band of latitude
  std::vector<glm::dvec3> points_;
  std::vector<Node> leaves_;  ///< empty once the tree stands
  std::vector<Node> nodes_;
  std::uint32_t root_ = 0;
};

}  // namespace tellurion::prepare
