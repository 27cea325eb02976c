#include "prepare/gdal/repair.h"

#include <algorithm>

#include <fmt/format.h>

#include "prepare/void_fill.h"

namespace tellurion::prepare {

Result<RepairPlan> RepairPlan::create(const RepairOptions& options, IngestKind kind, const OutputPlan&) {
  if (options.fill_voids > 0 && kind != IngestKind::height) return {ErrorCode::invalid_argument, "--fill-voids is for heights, and these inputs are pictures; leave it out"};
  RepairPlan repair;
  repair.options_ = options;
  return repair;
}

int RepairPlan::margin() const { return options_.fill_voids > 0 ? void_fill_margin(options_.fill_voids) : 0; }

std::string RepairPlan::description() const {
  if (!options_.any()) return "";
  return fmt::format("|repair 1|voids {}", options_.fill_voids);
}

std::size_t RepairPlan::bytes(const OutputPlan& plan) const {
  if (!options_.any()) return 0;
  constexpr std::size_t kPatchBytes = 80;   // of a void's pixel while it is filled
  constexpr std::size_t kWindowBytes = 16;  // as numbers, before and after, and what is still open
  const auto add_margins = [&](int pixels) { return static_cast<std::size_t>(pixels) + 2 * static_cast<std::size_t>(margin()); };
  const std::size_t window = add_margins(std::min(plan.chunk_width, plan.width)) * add_margins(std::min(plan.block, plan.height));
  const auto side = static_cast<std::size_t>(options_.fill_voids);
  return window * (2 * plan.layout.pixel_bytes() + kWindowBytes) + side * side * kPatchBytes;
}

}  // namespace tellurion::prepare
