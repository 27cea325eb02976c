// Makes chunks: reads, halves, compresses and keeps.
// One object for each thread.
#pragma once

#include <filesystem>

#include <gdal_priv.h>

#include "base/result.h"
#include "prepare/gdal/inputs.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

/// What a worker needs at most, in bytes, beside GDAL's block cache.
std::size_t worker_bytes(const OutputPlan& plan);

class ChunkWorker {
 public:
  static Result<ChunkWorker> create(const Mosaic& mosaic, std::filesystem::path folder);

  /// Makes the file of a chunk. Errors: corrupt (an input), unavailable (the folder).
  Result<void> make(int index);

 private:
  ChunkWorker(const OutputPlan& plan, GDALDatasetUniquePtr dataset, std::filesystem::path folder)
      : plan_(&plan), dataset_(std::move(dataset)), folder_(std::move(folder)) {}

  const OutputPlan* plan_;
  GDALDatasetUniquePtr dataset_;
  std::filesystem::path folder_;
};

}  // namespace tellurion::prepare
