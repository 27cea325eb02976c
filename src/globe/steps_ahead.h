// Steps of time that come up: opened and fetched before they are shown, so that no frame waits for them.
// Lives on the render thread.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include "base/time.h"
#include "globe/globe.h"
#include "surface/draw_list.h"

namespace tellurion::globe {

class StepsAhead {
 public:
  using Surface = std::shared_ptr<const surface::SurfaceDescription>;
  using TimePoint = std::chrono::steady_clock::time_point;

  StepsAhead();

  /// The surface to show at `time` in place of `shown`: that stays until a worker has opened what another step needs.
  Surface at(Globe& globe, const std::optional<UtcTime>& time, const Surface& shown);
  /// Whether the last answer of `at` was not that of its time.
  bool is_behind() const { return behind_; }

  /// Call once a frame. While the world's time runs and nothing else is wanted (`idle`): has what `drawn` will show in two
  /// seconds fetched.
  void foresee(Globe& globe, const std::optional<UtcTime>& time, TimePoint now, const surface::SurfaceDescription& shown,
               std::span<const surface::DrawTile> drawn, bool idle);

 private:
  struct Work;
  /// How much of the world's time passes in a second, by the last two frames; nothing if it rests.
  std::optional<UtcTime::duration> rate(const std::optional<UtcTime>& time, TimePoint now);

  std::shared_ptr<Work> work_;
  bool behind_ = false;
  std::optional<UtcTime> last_time_;
  TimePoint last_frame_;
  Surface next_;
  std::set<geo::TileKey> asked_;  ///< of `next_`
};

}  // namespace tellurion::globe
