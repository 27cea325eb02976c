// How low the ground is as far as a camera sees it: what its horizon is made of.
// Render side: looks into the nodes of the tile tree and makes those that it needs.
#pragma once

#include "surface/selection_wanted.h"

namespace tellurion::surface {

/// A lower bound of the displayed heights of all ground in the picture up to where lines of sight meet that bound: metres, at most 0 and
/// at least `frame.lowest`. A line from above the ground that meets the ellipsoid lowered by it (see Horizon) has
/// met the ground before; an eye below the ground may be shown less than there is.
double lowest_in_sight(NodePool& pool, const SelectionFrame& frame);

}  // namespace tellurion::surface
