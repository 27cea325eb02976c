#include "globe/resident_heights.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

#include "globe/surface_worker.h"

namespace tellurion::globe {
namespace {

constexpr std::chrono::seconds kPause{1};  ///< after what could not be read

}  // namespace

struct ResidentHeights::State {
  std::mutex mutex;
  std::shared_ptr<const surface::GlobalHeights> grid;
  std::shared_ptr<const surface::SurfaceDescription> surface;  ///< of the grid
  bool making = false;
  source::Awaited awaited;                                     ///< what the next grid waits for
  std::chrono::steady_clock::time_point not_before{};

  /// Whether the grid of `wanted` is to be asked for now. With the lock held.
  bool may_begin(const std::shared_ptr<const surface::SurfaceDescription>& wanted) {
    if (making || surface == wanted) return false;
    if (surface && surface->heights == wanted->heights) {
      surface = wanted;  // lets go of what else the old one held
      return false;
    }
    return std::chrono::steady_clock::now() >= not_before && std::ranges::all_of(awaited, [](const auto& arrival) { return arrival->over(); });
  }

  void make(SurfaceWorker& worker, const std::shared_ptr<const surface::SurfaceDescription>& wanted);
};

void ResidentHeights::State::make(SurfaceWorker& worker, const std::shared_ptr<const surface::SurfaceDescription>& wanted) {
  source::Awaited missing;
  bool pending = false;
  std::shared_ptr<const surface::GlobalHeights> made;
  if (const auto model = worker.elevation(wanted)) {
    auto heights = surface::GlobalHeights::make(**model);
    pending = (*model)->take_pending(missing);
    if (heights && !pending) made = std::make_shared<const surface::GlobalHeights>(std::move(*heights));
  }
  std::lock_guard lock(mutex);
  making = false;
  awaited = std::move(missing);
  if (made) {
    grid = std::move(made);
    surface = wanted;
  } else if (!pending) {
    not_before = std::chrono::steady_clock::now() + kPause;
  }
}

ResidentHeights::ResidentHeights(Submit submit) : submit_(std::move(submit)), state_(std::make_shared<State>()) {}

std::shared_ptr<const surface::GlobalHeights> ResidentHeights::of(const std::shared_ptr<const surface::SurfaceDescription>& surface) {
  std::lock_guard lock(state_->mutex);
  if (state_->may_begin(surface)) state_->making = submit_([state = state_, surface](SurfaceWorker& worker) { state->make(worker, surface); });
  return state_->grid;
}

}  // namespace tellurion::globe
