#include "prepare/gdal/repair.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "prepare/clouds.h"
#include "prepare/void_fill.h"

namespace tellurion::prepare {

Result<RepairPlan> RepairPlan::create(const IngestOptions& options, IngestKind kind, const OutputPlan& plan) {
  RepairPlan repair;
  repair.options_ = options.repair;
  if (repair.options_.fill_voids > 0 && kind != IngestKind::height) {
    return {ErrorCode::invalid_argument, "--fill-voids is for heights, and these inputs are pictures; fill them by --fill-from"};
  }
  if (repair.options_.clouds && kind != IngestKind::picture) return {ErrorCode::invalid_argument, "--clouds is for pictures, and these inputs are heights; leave it out"};
  if (repair.options_.clouds && !repair.options_.fill_from) return {ErrorCode::invalid_argument, "--clouds needs --fill-from: a picture without clouds"};
  if (repair.options_.fill_from) {
    Result<std::shared_ptr<const BaseRaster>> base = BaseRaster::create(*repair.options_.fill_from, options, kind, plan);
    if (!base) return base.error();
    repair.base_ = std::move(*base);
  }
  if (!repair.options_.coasts.empty()) {
    Result<std::shared_ptr<const Coast>> coast = Coast::create(repair.options_.coasts, plan.crs);
    if (!coast) return coast.error();
    repair.coast_ = std::move(*coast);
  }
  return repair;
}

int RepairPlan::grid() const { return base_ ? kBaseFillGrid : 1; }

int RepairPlan::margin() const {
  return (base_ ? kBaseFillReach : 0) + (options_.fill_voids > 0 ? void_fill_margin(options_.fill_voids) : 0) + (options_.clouds ? kCloudReach : 0);
}

std::string RepairPlan::description() const {
  if (!options_.any()) return "";
  return fmt::format("|repair 1|voids {}|base {}|clouds {}|coast {} {}", options_.fill_voids, base_ ? base_->revision() : "", options_.clouds.value_or(0.0), coast_ ? coast_->revision : "", options_.sea_beyond);
}

std::size_t RepairPlan::bytes(const OutputPlan& plan) const {
  if (!options_.fills()) return 0;
  constexpr std::size_t kPatchBytes = 100;  // of a void's pixel while it is filled
  const auto bands = static_cast<std::size_t>(plan.layout.bands);
  const std::size_t window_bytes = options_.clouds ? 16 + 12 * bands : base_ ? 32 : 16;  // as numbers
  const auto add_margins = [&](int pixels) { return static_cast<std::size_t>(pixels) + 2 * static_cast<std::size_t>(margin()) + static_cast<std::size_t>(grid()); };
  const std::size_t window = add_margins(std::min(plan.chunk_width, plan.width)) * add_margins(std::min(plan.block, plan.height));
  const auto side = static_cast<std::size_t>(options_.fill_voids);
  return window * (3 * plan.layout.pixel_bytes() + window_bytes) + side * side * kPatchBytes;
}

}  // namespace tellurion::prepare
