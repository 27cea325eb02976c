// The inputs of a preparation: looked at, brought onto one grid, and laid over one another.
#pragma once

#include <memory>
#include <string>

#include <gdal_priv.h>

#include "base/result.h"
#include "prepare/gdal/repair.h"
#include "prepare/ingest.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

/// All inputs as one raster of the plan's grid and bands.
class Mosaic {
 public:
  /// Looks at every input. Errors: as `ingest`.
  static Result<Mosaic> create(const IngestOptions& options);

  const OutputPlan& plan() const { return plan_; }
  const RepairPlan& repair() const { return repair_; }
  /// A data set of its own for each thread. Errors: as open_dataset.
  Result<GDALDatasetUniquePtr> open() const;

 private:
  OutputPlan plan_;
  RepairPlan repair_;
  std::string name_;
  std::shared_ptr<const void> files_;  ///< in GDAL's memory, removed with the last mosaic that needs them
};

/// A window of an open mosaic, in the plan's samples. Errors: corrupt, naming the file that could not be read.
Result<Samples> read_window(GDALDataset& mosaic, const SampleLayout& layout, int x, int y, int width, int height);

}  // namespace tellurion::prepare
