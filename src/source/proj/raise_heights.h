// Heights above a vertical datum, read from a raster, to heights above the ellipsoid.
#pragma once

#include "raster/height_grid.h"
#include "source/proj/pixel_mapping.h"
#include "source/proj/vertical_datum.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// Raises the samples of `window` of a level of the raster `about`, within 1 mm of the datum's own undulations.
void raise_to_ellipsoid(raster::HeightGrid& grid, const RasterDescription& about, int level, const PixelWindow& window, PixelMapping& mapping,
                        VerticalDatum& datum);

}  // namespace tellurion::source
