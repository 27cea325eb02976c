// Levels of detail from strips of rows: each level is half of the one before.
// Memory: about two strips of the finest level, whatever the height.
#pragma once

#include <functional>
#include <vector>

#include "base/result.h"
#include "prepare/samples.h"

namespace tellurion::prepare {

/// Columns or rows of a level: halves, odd ones rounded up.
constexpr int size_at(int size, int level) {
  for (int i = 0; i < level; ++i) size = (size + 1) / 2;
  return size;
}

/// Takes level 0 from the north to the south, and hands on every level in strips of as many rows (the last may have fewer).
class PyramidStream {
 public:
  /// A strip of a level, its first row; strips of one level come in order.
  using Take = std::function<Result<void>(int level, int first_row, const Samples& strip)>;

  /// `strip_rows` is even. Levels are 0 to `last_level`.
  PyramidStream(SampleLayout layout, int width, int height, int strip_rows, int last_level, Take take);

  /// The next `strip_rows` rows, or all that remain. Errors: those of `take`.
  Result<void> push(Samples strip);

 private:
  struct Level {
    int height = 0;
    int first_row = 0;  ///< of what waits
    Samples waiting;
  };

  Result<void> pass(int level, const Samples& strip);

  SampleLayout layout_;
  int strip_rows_;
  Take take_;
  std::vector<Level> levels_;
};

}  // namespace tellurion::prepare
