// Reads a mosaic and mends what it reads.
// One object for each thread.
#pragma once

#include <gdal_priv.h>

#include "base/result.h"
#include "prepare/gdal/inputs.h"
#include "prepare/void_fill.h"

namespace tellurion::prepare {

class RepairedReader {
 public:
  static Result<RepairedReader> create(const Mosaic& mosaic);

  /// A window in the plan's samples: the same samples whatever the window. Errors: as read_window.
  Result<Samples> read(int x, int y, int width, int height);

 private:
  RepairedReader(const Mosaic& mosaic, GDALDatasetUniquePtr dataset) : plan_(&mosaic.plan()), repair_(&mosaic.repair()), dataset_(std::move(dataset)) {}

  /// The window and the margin around it; `inner` is where in it the window lies.
  Result<Samples> read_around(int x, int y, int width, int height, PixelBox& inner);

  const OutputPlan* plan_;
  const RepairPlan* repair_;
  GDALDatasetUniquePtr dataset_;
};

}  // namespace tellurion::prepare
