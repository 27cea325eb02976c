// Smaller grids by averaging: each coarse sample is the mean of the fine ones under it, by area.
// Thread-safe as values are. Takes the fine rows strip by strip, so that memory is bounded by the coarse grid.
#pragma once

#include <vector>

#include "raster/height_grid.h"
#include "raster/image.h"

namespace tellurion::raster {

/// How a coarse window lies on the fine grid: coarse sample (i, j) covers [x + i step_x, x + (i+1) step_x) of the fine
/// columns, and rows likewise. Requires steps >= 1.
struct BoxLayout {
  int width = 0;  ///< of the coarse window
  int height = 0;
  double x = 0.0;  ///< fine coordinates of its upper left corner
  double y = 0.0;
  double step_x = 1.0;
  double step_y = 1.0;
};

/// Sums fine samples into coarse ones.
class BoxAverage {
 public:
  explicit BoxAverage(const BoxLayout& layout);

  /// Takes the fine rows from `first_row` on; column 0 of the strip is `first_column` of the fine grid.
  /// Void heights are left out; colours are averaged as they are (premultiplied), voids included.
  void add(const HeightGrid& strip, int first_column, int first_row);
  void add(const Image& strip, int first_column, int first_row);

  /// What was added: a height is NaN where no valid sample lies under it.
  HeightGrid heights() const;
  Image image() const;

 private:
  template <int kChannels, class Sample>
  void add_samples(const Sample* samples, int strip_width, int strip_height, int first_column, int first_row);

  BoxLayout layout_;
  std::vector<double> sums_;
  std::vector<double> weights_;
};

}  // namespace tellurion::raster
