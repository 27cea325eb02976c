// Blocks compressed by GDAL, and the TIFF fields that describe them.
// Safe to call on several threads at once.
#pragma once

#include <vector>

#include "base/result.h"
#include "prepare/plan.h"
#include "prepare/samples.h"
#include "prepare/tiff.h"

namespace tellurion::prepare {

/// Whether this GDAL compresses so. Errors: unsupported, naming what there is.
Result<void> check_codec(const std::string& compress);

/// One block of `plan.block` pixels on a side, as it stands in a file. Errors: internal.
Result<std::vector<std::byte>> compress_block(const OutputPlan& plan, const Samples& block);

/// The fields of the directory of every level, the finest first, without where the blocks are; GDAL has written them.
Result<std::vector<TiffDirectory>> describe_levels(const OutputPlan& plan, const std::vector<BandStatistics>& bands);

}  // namespace tellurion::prepare
