// A complete raster that what is missing is taken from, on the output's grid.
#pragma once

#include <memory>
#include <string>

#include <gdal_priv.h>

#include "base/result.h"
#include "prepare/gdal/memory_files.h"
#include "prepare/ingest.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

class BaseRaster {
 public:
  /// Looks at `path`. Errors, naming the file and what to do: as `ingest`.
  static Result<std::shared_ptr<const BaseRaster>> create(const std::string& path, const IngestOptions& options, IngestKind kind, const OutputPlan& plan);

  /// What its samples depend on.
  const std::string& revision() const { return revision_; }
  const SampleLayout& layout() const { return layout_; }
  /// A data set of its own for each thread. Errors: as open_dataset.
  Result<GDALDatasetUniquePtr> open() const;

 private:
  SampleLayout layout_;
  std::string revision_;
  std::string name_;
  MemoryFiles files_;
};

}  // namespace tellurion::prepare
