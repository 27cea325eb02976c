// Makes chunks: reads, halves, compresses and keeps.
// One object for each thread.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "prepare/gdal/inputs.h"
#include "prepare/gdal/repaired_reader.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

/// What a worker needs at most, in bytes, beside GDAL's block cache.
std::size_t worker_bytes(const OutputPlan& plan, const RepairPlan& repair);

class ChunkWorker {
 public:
  static Result<ChunkWorker> create(const Mosaic& mosaic, std::filesystem::path folder);

  /// Makes the file of a chunk. Errors: corrupt (an input), unavailable (the folder).
  Result<void> make(int index);

 private:
  ChunkWorker(const OutputPlan& plan, RepairedReader reader, std::filesystem::path folder) : plan_(&plan), reader_(std::move(reader)), folder_(std::move(folder)) {}

  const OutputPlan* plan_;
  RepairedReader reader_;
  std::filesystem::path folder_;
};

}  // namespace tellurion::prepare
