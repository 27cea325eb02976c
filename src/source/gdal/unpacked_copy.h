// Copies of rasters that cannot be read in parts, as tiled files that can.
// Thread-safe, and safe among processes: a copy appears whole or not at all.
#pragma once

#include <filesystem>
#include <string>

#include <gdal_priv.h>

#include "base/result.h"

namespace tellurion::source {

/// The file of `folder` that holds the samples of `dataset`, lossless; made if it is not there. `revision` names the content.
/// Errors: unavailable, naming the file that could not be written, and why.
Result<std::string> unpacked_copy(GDALDataset& dataset, const std::string& revision, const std::filesystem::path& folder);

}  // namespace tellurion::source
