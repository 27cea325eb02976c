// A debug source: a grid on the ground whose cells have a round size, which is written in them.
#pragma once

#include <memory>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/raster_source.h"

namespace tellurion::source {

enum class ScaleUnit { metres, kilometres };

/// Rows of cells parallel to the equator, each exactly as high on the ellipsoid as its label says and, on the middle parallel of
/// its row, exactly as wide; counted from the equator and from longitude 0. Edges have ten ticks. Sizes are 1, 2 or 5 times a
/// power of ten, about 160 to 400 pixels of the raster's level. A cell that the pole or longitude 180 cuts has no label.
/// Errors: those of the projection.
Result<std::unique_ptr<RasterSource>> open_scale_reference(ScaleUnit unit, const geo::Ellipsoid& world);

/// Distance on the ellipsoid from the equator along a meridian, negative in the south. Error below 1e-6 of the distance.
Metres meridian_arc(const geo::Ellipsoid& ellipsoid, Radians latitude);
/// The reverse; requires |arc| to be at most the pole's.
Radians latitude_of_arc(const geo::Ellipsoid& ellipsoid, Metres arc);

}  // namespace tellurion::source
