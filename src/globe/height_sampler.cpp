#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "globe/globe.h"
#include "globe/surface_worker.h"
#include "surface/global_heights.h"

namespace tellurion::globe {
namespace {

constexpr std::size_t kMostAsked = 4096;   ///< places that a worker looks up at a time
constexpr std::chrono::seconds kPause{1};  ///< after what could not be read

/// The answer once all that it rests on is there; every round asks for at least one file more, and each ends in time.
template <class Ask>
auto with_data(surface::ElevationModel& model, const Ask& ask) {
  for (;;) {
    auto answer = ask();
    source::Awaited awaited;
    if (!model.take_pending(awaited)) return answer;
    for (const auto& arrival : awaited) arrival->wait({});
    if (awaited.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // another reader has asked for it
  }
}

/// Places whose samples a worker brings into memory.
struct Asked {
  struct Place {
    geo::LatLon place;
    double wanted_spacing = 0;
  };
  std::mutex mutex;
  std::vector<Place> places;
  bool busy = false;
  source::Awaited awaited;  ///< what answers wait for: kept, so that it comes
  std::chrono::steady_clock::time_point not_before{};

  void look_up(SurfaceWorker& worker, const std::shared_ptr<const surface::SurfaceDescription>& surface);
};

void Asked::look_up(SurfaceWorker& worker, const std::shared_ptr<const surface::SurfaceDescription>& surface) {
  std::vector<Place> wanted;
  {
    std::lock_guard lock(mutex);
    wanted.swap(places);
  }
  bool failed = true;
  source::Awaited missing;
  if (const auto model = worker.elevation(surface)) {
    failed = false;
    for (const Place& one : wanted) failed = !(*model)->height_at(one.place, surface::Lookup::bilinear, one.wanted_spacing).has_value() || failed;
    (*model)->take_pending(missing);
  }
  std::lock_guard lock(mutex);
  busy = false;
  if (!missing.empty()) awaited = std::move(missing);
  if (failed) not_before = std::chrono::steady_clock::now() + kPause;
}

}  // namespace

struct HeightSampler::State {
  const Globe& globe;
  Submit submit;
  std::shared_ptr<const surface::SurfaceDescription> surface;
  cache::BlockCache& blocks;
  surface::ElevationModel model;
  std::optional<surface::ElevationModel> idle{};  ///< of height_now: reads nothing
  std::shared_ptr<Asked> asked = std::make_shared<Asked>();

  double level_of(double spacing) const { return std::isfinite(spacing) ? std::log2(std::numbers::pi * surface->ellipsoid.a() / spacing) : -1.0; }
  void ask_for(const geo::LatLon& place, double wanted_spacing);
};

void HeightSampler::State::ask_for(const geo::LatLon& place, double wanted_spacing) {
  std::lock_guard lock(asked->mutex);
  if (asked->places.size() < kMostAsked) asked->places.push_back({place, wanted_spacing});
  if (asked->busy || std::chrono::steady_clock::now() < asked->not_before) return;
  asked->busy = submit([asked = asked, surface = surface](SurfaceWorker& worker) { asked->look_up(worker, surface); });
}

HeightSampler::HeightSampler(std::unique_ptr<State> state) : state_(std::move(state)) {}
HeightSampler::HeightSampler(HeightSampler&&) noexcept = default;
HeightSampler::~HeightSampler() = default;

Result<HeightSampler> HeightSampler::open(const Globe& globe, cache::BlockCache& blocks, Submit submit) {
  auto surface = globe.surface();
  auto model = surface::ElevationModel::open(surface, blocks);
  if (!model) return model.error();
  return HeightSampler(std::make_unique<State>(State{globe, std::move(submit), std::move(surface), blocks, std::move(*model)}));
}

Result<HeightSampler::Answer> HeightSampler::height_at(const geo::LatLon& place, HeightLookup lookup, Metres wanted_spacing) {
  const auto how = lookup == HeightLookup::nearest ? surface::Lookup::nearest : surface::Lookup::bilinear;
  const auto found = with_data(state_->model, [&] { return state_->model.height_at(place, how, wanted_spacing.value); });
  if (!found) return found.error();
  return Answer{EllipsoidalHeight(found->metres), state_->level_of(found->spacing)};
}

HeightSampler::AnswerNow HeightSampler::height_now(const geo::LatLon& place, Metres wanted_spacing) {
  State& s = *state_;
  if (!s.idle) {
    if (auto opened = surface::ElevationModel::open(s.surface, s.blocks)) {
      s.idle.emplace(std::move(*opened));
      s.idle->read_nothing();
    }
  }
  const auto global = s.globe.resident_heights();
  const double coarsest = global ? global->spacing() : std::numeric_limits<double>::infinity();
  source::Awaited none;
  // Ever coarser samples, until some are in memory; few steps, for each is twice as coarse.
  double spacing = wanted_spacing.value;
  bool is_wanted = true;
  while (s.idle && (is_wanted || spacing < coarsest)) {
    const auto found = s.idle->height_at(place, surface::Lookup::bilinear, spacing);
    const bool known = found && !s.idle->take_pending(none);
    if (known) return {{EllipsoidalHeight(found->metres), s.level_of(found->spacing)}, is_wanted};
    if (is_wanted) s.ask_for(place, spacing);
    if (!found || !std::isfinite(found->spacing)) break;
    spacing = 2.0 * std::max(spacing, found->spacing);
    is_wanted = false;
  }
  if (!global) return {{EllipsoidalHeight(0.0), -1.0}, false};
  return {{EllipsoidalHeight(global->at(place)), s.level_of(global->spacing())}, false};
}

Result<geo::Vector<geo::Ecef>> HeightSampler::normal_at(const geo::LatLon& place, Metres wanted_spacing) {
  return with_data(state_->model, [&] { return state_->model.surface_normal_at(place, wanted_spacing.value); });
}

}  // namespace tellurion::globe
