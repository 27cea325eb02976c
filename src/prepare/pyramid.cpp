#include "prepare/pyramid.h"

#include <cassert>
#include <utility>

namespace tellurion::prepare {

PyramidStream::PyramidStream(SampleLayout layout, int width, int height, int strip_rows, int last_level, Take take)
    : layout_(std::move(layout)), strip_rows_(strip_rows), take_(std::move(take)) {
  assert(strip_rows % 2 == 0);
  for (int level = 0; level <= last_level; ++level) levels_.push_back({size_at(height, level), 0, {size_at(width, level), 0, {}}});
}

Result<void> PyramidStream::push(Samples strip) { return pass(0, strip); }

Result<void> PyramidStream::pass(int level, const Samples& strip) {
  Level& here = levels_[static_cast<std::size_t>(level)];
  assert(strip.height == strip_rows_ || here.first_row + strip.height == here.height);
  if (Result<void> taken = take_(level, here.first_row, strip); !taken) return taken;
  here.first_row += strip.height;
  if (level + 1 == static_cast<int>(levels_.size())) return {};
  Level& next = levels_[static_cast<std::size_t>(level) + 1];
  const Samples half = halve(layout_, strip);
  next.waiting.height += half.height;
  next.waiting.bytes.insert(next.waiting.bytes.end(), half.bytes.begin(), half.bytes.end());
  if (next.waiting.height < strip_rows_ && next.first_row + next.waiting.height < next.height) return {};
  const Samples full = std::exchange(next.waiting, Samples{half.width, 0, {}});
  return pass(level + 1, full);
}

}  // namespace tellurion::prepare
