#include "globe/steps_ahead.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <mutex>
#include <utility>
#include <vector>

#include "globe/surface_worker.h"

namespace tellurion::globe {
namespace {

constexpr double kAhead = 2.0;         // seconds
constexpr double kLongestFrame = 0.5;  // after a longer pause nothing is known of the rate
constexpr std::size_t kTilesAtOnce = 8;

bool has_layer(const surface::SurfaceDescription& surface, std::uint32_t source_id) {
  return std::ranges::any_of(surface.colours, [&](const surface::Layer& layer) { return layer.source_id == source_id; });
}

/// Whether a layer that only `next` has touches the tile.
bool changes(const surface::SurfaceDescription& shown, const surface::SurfaceDescription& next, const geo::TileKey& key) {
  return std::ranges::any_of(next.colours, [&](const surface::Layer& layer) {
    return !has_layer(shown, layer.source_id) && surface::coverage_of(layer).touches(key);
  });
}

}  // namespace

/// What workers have of it.
struct StepsAhead::Work {
  std::atomic<bool> opening{false};
  std::atomic<bool> fetching{false};
  std::mutex mutex;         ///< guards what follows, for moments
  Surface opened;
  source::Awaited awaited;  ///< who lets go of it no longer wants the data
};

StepsAhead::StepsAhead() : work_(std::make_shared<Work>()) {}

StepsAhead::Surface StepsAhead::at(Globe& globe, const std::optional<UtcTime>& time, const Surface& shown) {
  Surface held = globe.held_surface_at(time);
  behind_ = held == nullptr;
  if (held) return held;
  if (!work_->opening.exchange(true)) {
    const bool submitted = globe.try_submit_at(time, [work = work_](SurfaceWorker&, const Surface& surface) {
      {
        std::lock_guard lock(work->mutex);
        work->opened = surface;
      }
      work->opening = false;
    });
    if (!submitted) work_->opening = false;
  }
  // Time may run faster than files are opened: then the last that was.
  std::unique_lock lock(work_->mutex, std::try_to_lock);
  Surface opened = lock ? std::exchange(work_->opened, nullptr) : nullptr;
  return opened ? opened : shown;
}

std::optional<UtcTime::duration> StepsAhead::rate(const std::optional<UtcTime>& time, TimePoint now) {
  const std::optional<UtcTime> before = std::exchange(last_time_, time);
  const double elapsed = std::chrono::duration<double>(now - std::exchange(last_frame_, now)).count();
  if (!before || !time || *before == *time || !(elapsed > 0 && elapsed < kLongestFrame)) return std::nullopt;
  return std::chrono::duration_cast<UtcTime::duration>((*time - *before) / elapsed);
}

void StepsAhead::foresee(Globe& globe, const std::optional<UtcTime>& time, TimePoint now, const surface::SurfaceDescription& shown,
                         std::span<const surface::DrawTile> drawn, bool idle) {
  const auto running = rate(time, now);
  if (std::unique_lock lock(work_->mutex, std::try_to_lock); lock) {
    std::erase_if(work_->awaited, [](const auto& arrival) { return arrival->over(); });
  }
  if (!running || !idle || work_->fetching) return;
  const UtcTime later = *time + std::chrono::duration_cast<UtcTime::duration>(*running * kAhead);
  Surface next = globe.held_surface_at(later);
  if (next && next->revision == shown.revision) return;
  std::vector<geo::TileKey> keys;
  if (next) {
    if (next != next_) asked_.clear();
    next_ = next;
    for (const surface::DrawTile& tile : drawn) {
      if (keys.size() == kTilesAtOnce) break;
      if (changes(shown, *next, tile.colour_owner) && asked_.insert(tile.colour_owner).second) keys.push_back(tile.colour_owner);
    }
    if (keys.empty()) return;
  }
  work_->fetching = true;
  const bool submitted = globe.try_submit_at(later, [work = work_, keys](SurfaceWorker& worker, const Surface& surface) {
    for (const geo::TileKey& key : keys) {
      const auto imagery = worker.build_colour(surface, key, {});
      if (imagery || imagery.error().code != ErrorCode::pending) continue;
      source::Awaited awaited = worker.take_awaited();
      std::lock_guard lock(work->mutex);
      std::ranges::move(awaited, std::back_inserter(work->awaited));
    }
    work->fetching = false;
  });
  if (!submitted) {
    work_->fetching = false;
    for (const geo::TileKey& key : keys) asked_.erase(key);
  }
}

}  // namespace tellurion::globe
