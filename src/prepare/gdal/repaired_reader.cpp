#include "prepare/gdal/repaired_reader.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
  return RepairedReader(mosaic, std::move(dataset).value());
}

Result<Samples> RepairedReader::read(int x, int y, int width, int height) {
  Result<Samples> samples = read_window(*dataset_, plan_->layout, x, y, width, height);
  if (!samples || !repair_->options().any() || !has_voids(plane_of(plan_->layout, *samples, 0))) return samples;
  PixelBox inner;
  samples = read_around(x, y, width, height, inner);
  if (!samples) return samples;
  Plane heights = plane_of(plan_->layout, *samples, 0);
  fill_voids(heights, inner, repair_->options().fill_voids);
  fill_band(plan_->layout, *samples, 0, heights);
  return cut_window(plan_->layout, *samples, inner.x, inner.y, width, height);
}

Result<Samples> RepairedReader::read_around(int x, int y, int width, int height, PixelBox& inner) {
  const int margin = repair_->margin();
  const int left = std::max(x - margin, 0), top = std::max(y - margin, 0);
  inner = {x - left, y - top, width, height};
  return read_window(*dataset_, plan_->layout, left, top, std::min(x + width + margin, plan_->width) - left, std::min(y + height + margin, plan_->height) - top);
}

}  // namespace tellurion::prepare
