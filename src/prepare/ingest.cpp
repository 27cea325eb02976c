#include "prepare/ingest.h"

#ifndef TELLURION_HAS_GDAL

namespace tellurion::prepare {

std::filesystem::path work_folder(const std::filesystem::path& out) { return std::filesystem::path(out) += ".work"; }

Result<IngestReport> ingest(const IngestOptions&, const IngestWatch&) { return {ErrorCode::unsupported, "this program was built without GDAL, which prepares rasters"}; }
Result<IngestReport> merge(const MergeOptions&, const IngestWatch&) { return ingest({}, {}); }

}  // namespace tellurion::prepare

#endif
