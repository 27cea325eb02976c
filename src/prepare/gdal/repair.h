// What is mended, decided before any sample is read.
// Thread-safe: values and pure functions.
#pragma once

#include <string>

#include "base/result.h"
#include "prepare/ingest.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

class RepairPlan {
 public:
  /// Errors: invalid_argument, saying what to do.
  static Result<RepairPlan> create(const RepairOptions& options, IngestKind kind, const OutputPlan& plan);

  const RepairOptions& options() const { return options_; }
  /// How far from a pixel lies what it may depend on, in pixels.
  int margin() const;
  /// What the samples depend on, beside the inputs; empty: nothing is mended.
  std::string description() const;
  /// What a worker needs for it at most.
  std::size_t bytes(const OutputPlan& plan) const;

 private:
  RepairOptions options_;
};

}  // namespace tellurion::prepare
