#include "prepare/gdal/repaired_reader.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "prepare/clouds.h"
#include "prepare/plane.h"

namespace tellurion::prepare {
namespace {

bool has_voids(const Plane& plane) {
  return std::any_of(plane.values.begin(), plane.values.end(), [](float value) { return std::isnan(value); });
}

}  // namespace

Result<RepairedReader> RepairedReader::create(const Mosaic& mosaic) {
  Result<GDALDatasetUniquePtr> dataset = mosaic.open();
  if (!dataset) return dataset.error();
  RepairedReader reader(mosaic, std::move(dataset).value());
  const RepairPlan& repair = mosaic.repair();
  if (repair.base() != nullptr) {
    Result<GDALDatasetUniquePtr> base = repair.base()->open();
    if (!base) return base.error();
    reader.base_ = std::move(base).value();
  }
  if (repair.coast()) {
    Result<SeaCutter> sea = SeaCutter::create(repair.coast(), mosaic.plan(), repair.options().sea_beyond);
    if (!sea) return sea.error();
    reader.sea_.emplace(std::move(*sea));
  }
  return reader;
}

Result<Samples> RepairedReader::read(int x, int y, int width, int height) {
  Result<Samples> samples = read_filled({x, y, width, height});
  if (samples && sea_) sea_->cut({x, y, width, height}, *samples);
  return samples;
}

Result<Samples> RepairedReader::read_filled(const PixelBox& wanted) {
  Result<Samples> samples = read_mosaic(wanted);
  if (!samples || !repair_->options().fills() || (!repair_->options().clouds && !has_voids(plane_of(plan_->layout, *samples, 0)))) return samples;
  const PixelBox box = with_margin(wanted), inner{wanted.x - box.x, wanted.y - box.y, wanted.width, wanted.height};
  samples = read_mosaic(box);
  if (!samples) return samples;
  if (base_) {
    if (Result<void> filled = fill_from_base(box, *samples); !filled) return filled.error();
  }
  if (repair_->options().fill_voids > 0) {
    Plane heights = plane_of(plan_->layout, *samples, 0);
    fill_voids(heights, inner, repair_->options().fill_voids);
    fill_band(plan_->layout, *samples, 0, heights);
  }
  return cut_window(plan_->layout, *samples, inner.x, inner.y, inner.width, inner.height);
}

Result<Samples> RepairedReader::read_mosaic(const PixelBox& box) { return read_window(*dataset_, plan_->layout, box.x, box.y, box.width, box.height); }

PixelBox RepairedReader::with_margin(const PixelBox& box) const {
  const int margin = repair_->margin(), grid = repair_->grid();
  const int left = std::max(box.x - margin, 0) / grid * grid, top = std::max(box.y - margin, 0) / grid * grid;
  return {left, top, std::min(box.x + box.width + margin, plan_->width) - left, std::min(box.y + box.height + margin, plan_->height) - top};
}

std::vector<std::uint8_t> RepairedReader::clouds_in(const Samples& samples, const Samples& base) const {
  const SampleLayout& layout = repair_->base()->layout();
  std::vector<Plane> ours, its;
  for (int band = 0; band < layout.bands - (layout.alpha ? 1 : 0); ++band) {
    ours.push_back(plane_of(plan_->layout, samples, band));
    its.push_back(plane_of(layout, base, band));
  }
  return find_clouds(ours, its, static_cast<float>(*repair_->options().clouds));
}

Result<void> RepairedReader::fill_from_base(const PixelBox& box, Samples& samples) {
  const SampleLayout& layout = repair_->base()->layout();
  const Result<Samples> base = read_window(*base_, layout, box.x, box.y, box.width, box.height);
  if (!base) return base.error();
  const int colours = layout.bands - (layout.alpha ? 1 : 0);
  const std::vector<std::uint8_t> clouds = repair_->options().clouds ? clouds_in(samples, *base) : std::vector<std::uint8_t>{};
  Plane filling;
  for (int band = 0; band < colours; ++band) {
    Plane clear = plane_of(plan_->layout, samples, band);
    for (std::size_t i = 0; i < clouds.size(); ++i) {
      if (clouds[i] != 0) clear.values[i] = std::nanf("");
    }
    filling = prepare::fill_from_base(clear, plane_of(layout, *base, band));
    fill_band(plan_->layout, samples, band, filling);
    replace_in_band(plan_->layout, samples, band, filling, clouds);
  }
  if (plan_->layout.alpha) make_opaque(plan_->layout, samples, filling);
  return {};
}

}  // namespace tellurion::prepare
