// Reads a mosaic and mends what it reads.
// One object for each thread.
#pragma once

#include <optional>

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

  Result<Samples> read_filled(const PixelBox& box);
  Result<Samples> read_mosaic(const PixelBox& box);
  /// The box and the margin around it.
  PixelBox with_margin(const PixelBox& box) const;
  std::vector<std::uint8_t> clouds_in(const Samples& samples, const Samples& base) const;
  Result<void> fill_from_base(const PixelBox& box, Samples& samples);

  const OutputPlan* plan_;
  const RepairPlan* repair_;
  GDALDatasetUniquePtr dataset_;
  GDALDatasetUniquePtr base_;
  std::optional<SeaCutter> sea_;
};

}  // namespace tellurion::prepare
