// A smooth way from one pose to another, however far.
// Thread-safe: does not change once it is made.
// J. van Wijk and W. Nuij (2003), Smooth and efficient zooming and panning, doi:10.1109/INFVIS.2003.1249008.
#pragma once

#include "view/camera.h"
#include "view/rotation.h"

namespace tellurion::view {

/// Rises, travels along the great circle and sinks, so that the picture flows at a steady pace.
class Journey {
 public:
  Journey(const geo::Ellipsoid& ellipsoid, const Pose& from, const Pose& to);

  /// How much there is to see on the way: 1 is a change of scale by a factor of 4. A good duration is about 1 s for
  /// each.
  double length() const { return length_; }

  /// The pose after `fraction` in [0, 1] of the way; `from` and `to` at its ends. Starts and ends at rest.
  Pose pose_at(double fraction) const;

 private:
  Pose from_, to_;
  Turn turn_;                           ///< from the one place's normal to the other's
  double distance_ = 0;                 ///< metres between the places on the ground
  double from_size_ = 0, to_size_ = 0;  ///< the paper's w0 and w1: how much ground is seen, by the height
  double start_ = 0;                    ///< the paper's r0
  double length_ = 0;                   ///< the paper's S
};

}  // namespace tellurion::view
