// From what a world file says of a layer's data to the source that reads them.
// Thread-safe: a pure function, but for files and servers.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "geo/ellipsoid.h"
#include "globe/world.h"
#include "source/raster_source.h"

namespace tellurion::globe {

/// Opens the source of a layer that is neither of type "catalogue" nor one with times nor drawn by a program. `cache_folder`: where pictures are
/// kept unpacked; empty: nowhere. `needed_store` is called for sources on servers. Errors: those of opening, naming the file or URL.
Result<std::unique_ptr<source::RasterSource>> open_layer_source(const LayerSpec& spec, const geo::Ellipsoid& world, const std::filesystem::path& cache_folder,
                                                                const std::function<std::shared_ptr<fetch::ByteStore>()>& needed_store);

}  // namespace tellurion::globe
