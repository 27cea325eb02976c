// What is mended, decided before any sample is read.
// Thread-safe: values and pure functions.
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "prepare/gdal/base_raster.h"
#include "prepare/gdal/coast.h"
#include "prepare/ingest.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

class RepairPlan {
 public:
  /// `plan` in the CRS of what is read. Errors: as `ingest`.
  static Result<RepairPlan> create(const IngestOptions& options, IngestKind kind, const OutputPlan& plan);

  const RepairOptions& options() const { return options_; }
  const BaseRaster* base() const { return base_.get(); }
  const std::shared_ptr<const Coast>& coast() const { return coast_; }
  /// Where windows with a margin begin: at multiples of it.
  int grid() const;
  /// How far from a pixel lies what it may depend on, in pixels.
  int margin() const;
  /// What the samples depend on, beside the inputs; empty: nothing is mended.
  std::string description() const;
  /// What a worker needs for it at most.
  std::size_t bytes(const OutputPlan& plan) const;
  /// What all workers share.
  std::size_t shared_bytes() const { return coast_ ? coast_->shore.bytes() : 0; }

 private:
  RepairOptions options_;
  std::shared_ptr<const BaseRaster> base_;
  std::shared_ptr<const Coast> coast_;
};

}  // namespace tellurion::prepare
