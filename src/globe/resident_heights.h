// The grid of the whole body's heights that a globe always has in memory, made anew by a worker when its heights change.
// Thread-safe.
#pragma once

#include <functional>
#include <memory>

#include "surface/global_heights.h"

namespace tellurion::globe {

class SurfaceWorker;

class ResidentHeights {
 public:
  /// Has a worker do something; false if too much waits.
  using Submit = std::function<bool(std::function<void(SurfaceWorker&)>)>;
  explicit ResidentHeights(Submit submit);

  /// The grid as it is; null until the first is made. Has one made if it is not that of `surface`; reads and waits for nothing.
  std::shared_ptr<const surface::GlobalHeights> of(const std::shared_ptr<const surface::SurfaceDescription>& surface);

 private:
  struct State;
  Submit submit_;
  std::shared_ptr<State> state_;
};

}  // namespace tellurion::globe
