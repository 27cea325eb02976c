#include "prepare/gdal/base_raster.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "prepare/gdal/input.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::prepare {
namespace {

Result<void> check_bands(const Input& base, const OutputPlan& plan) {
  const int colours = plan.layout.bands - (plan.layout.alpha ? 1 : 0);
  if (base.colours != colours) return unsupported(base, fmt::format("has {} bands of colour and the output has {}; --fill-from takes a raster of as many", base.colours, colours));
  const BandAbout &ours = plan.bands.front(), &its = base.bands.front();
  if (ours.scale != its.scale || ours.offset != its.offset || (ours.unit != its.unit && !ours.unit.empty() && !its.unit.empty())) {
    return unsupported(base, "counts in other units than the inputs (scale, offset or unit of its bands); bring it to theirs first: gdal_translate -unscale -ot Float32 IN OUT.tif");
  }
  if (base.kind == IngestKind::picture && base.type != plan.layout.type) return unsupported(base, "has samples of another depth than the inputs; bring it to theirs first: gdal_translate -ot Byte -scale");
  return {};
}

}  // namespace

Result<std::shared_ptr<const BaseRaster>> BaseRaster::create(const std::string& path, const IngestOptions& options, IngestKind kind, const OutputPlan& plan) {
  auto base = std::make_shared<BaseRaster>();
  IngestOptions its_options;
  its_options.kind = kind;
  its_options.resampling = options.resampling;
  Result<Input> input = inspect(path, its_options, base->files_);
  if (!input) return input.error();
  if (Result<void> good = check_bands(*input, plan); !good) return good.error();
  input->warped = true;
  const Result<Extent> extent = extent_in(*input, plan.crs);
  if (!extent) return extent.error();
  input->fineness = std::sqrt(extent->pixel_x * extent->pixel_y / (plan.transform[1] * -plan.transform[5]));
  input->place = {0.0, 0.0, static_cast<double>(plan.width), static_cast<double>(plan.height)};
  base->revision_ = input->revision;
  if (Result<void> warped = warp(*input, its_options, plan, base->files_); !warped) return warped.error();
  base->name_ = input->source;
  base->layout_ = plan.layout;
  base->layout_.alpha = kind == IngestKind::picture;
  base->layout_.bands = input->colours + (base->layout_.alpha ? 1 : 0);
  base->layout_.no_data = kind == IngestKind::height ? std::optional(plan.layout.no_data.value_or(kOwnVoid)) : std::nullopt;
  return std::shared_ptr<const BaseRaster>(std::move(base));
}

Result<GDALDatasetUniquePtr> BaseRaster::open() const { return source::open_dataset(name_); }

}  // namespace tellurion::prepare
