// STAC items (https://stacspec.org, versions 0.9 to 1.1) as lists of rasters.
// Thread-safe: pure functions.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/catalogue/listing.h"

namespace tellurion::source {

/// Reads an item, or a collection of items (FeatureCollection, ItemCollection), `name` in `folder`, item by item: memory goes with the
/// largest. Of an item's assets that are rasters and no overviews, the one to show is taken: of role "visual", else "data", else the first.
/// Errors, naming the list: corrupt (no JSON, or nested too deeply), exhausted (too many items, or one too large), unsupported (JSON, but
/// no items).
Result<RasterList> read_stac(std::string_view text, const std::filesystem::path& folder, const std::string& name, const geo::Ellipsoid& world);

}  // namespace tellurion::source
