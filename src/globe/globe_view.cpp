#include "globe/globe_view.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <thread>
#include <variant>

#include <glm/geometric.hpp>

#include "base/bounded_queue.h"
#include "globe/ground_below.h"
#include "globe/motion.h"
#include "globe/patience.h"
#include "globe/slot_ages.h"
#include "globe/steps_ahead.h"
#include "globe/surface_worker.h"
#include "globe/view_look.h"
#include "globe/waiting_part.h"

namespace tellurion::globe {
namespace {

using Clock = std::chrono::steady_clock;
using surface::Part;

constexpr double kFrameBudgetMs = 1000.0 / 30.0;
constexpr std::chrono::seconds kRootDeadline{5};  ///< then a view begins without the roots that are still built
constexpr std::chrono::seconds kPause{1};  ///< before a part that failed is asked for again
constexpr std::chrono::seconds kPauseWithout{5};  ///< the same if it is shown without what failed
constexpr std::size_t kLeastBytes = 16u << 20;
constexpr std::size_t kMostWaiting = 128;  ///< parts whose data are on their way
constexpr std::size_t kMostAhead = 32;     ///< of them those that only a later view wants
constexpr double kRootGain = 1e9;          ///< nothing can be shown truly without the roots

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// What a worker made of a request. Awaited: nothing yet, because these data are on their way.
struct Finished {
  geo::TileKey key;
  Part part = Part::geometry;
  std::uint64_t revision = 0;  ///< of the surface that it shows
  std::variant<surface::TileGeometry, surface::TileImagery, source::Awaited, Error> content;
};

using FinishedQueue = BoundedQueue<Finished>;

/// What a part was composed without.
std::span<const surface::MissingLayer> missing_layers(const Finished& item) {
  if (const auto* imagery = std::get_if<surface::TileImagery>(&item.content)) return imagery->missing;
  if (const auto* geometry = std::get_if<surface::TileGeometry>(&item.content)) return geometry->missing;
  return {};
}

/// Their numbers, ascending.
std::vector<std::uint32_t> numbers_of(std::span<const surface::MissingLayer> layers) {
  std::vector<std::uint32_t> ids;
  for (const surface::MissingLayer& layer : layers) ids.push_back(layer.source_id);
  std::ranges::sort(ids);
  return ids;
}

}  // namespace

struct GlobeView::State {
  State(Globe& g, gpu::RenderThread& t)
      : globe(g), thread(t), surface(g.surface()), facts(g.facts()), first_facts(facts), heights(surface), tree(g.ellipsoid(), facts) {}

  Globe& globe;
  gpu::RenderThread& thread;
  std::unique_ptr<render::Renderer> renderer;
  std::shared_ptr<const surface::SurfaceDescription> surface;  ///< at the time that is shown
  std::shared_ptr<const surface::SurfaceFacts> facts;          ///< of it
  std::shared_ptr<const surface::SurfaceFacts> first_facts;    ///< of the globe: tell when the tables change
  std::shared_ptr<const surface::SurfaceDescription> heights;  ///< the surface whose heights are shown
  surface::TileTree tree;                                      ///< of `facts`
  SlotAges slots{Part::colour};
  SlotAges meshes{Part::geometry};                             ///< roots are not made anew by it: see roots_to_renew
  SlotAges::Stale stale;                                       ///< of the last frame
  SlotAges::Stale stale_meshes;
  /// Room for all that can be in flight, so that no worker ever waits on it.
  std::shared_ptr<FinishedQueue> finished;
  GroundBelow ground;
  std::stop_source stop;
  int in_flight = 0;        ///< parts that workers have
  std::vector<WaitingPart> waiting;
  int roots_to_renew = 0;   ///< whose geometry was built by older facts and has not been asked for again
  int roots_renewing = 0;
  std::map<geo::TileKey, Clock::time_point> roots_to_retry;  ///< whose heights failed: a bare ellipsoid stands in until then
  Patience patience;
  int max_in_flight = 0;
  std::size_t max_bytes = 0;
  Clock::time_point created = Clock::now();
  const surface::Selection* selection = nullptr;
  Motion motion;
  StepsAhead steps;
  std::vector<surface::TileRequest> ahead;  ///< what a later view will want
  bool transitions = false;                 ///< of the last frame's settings
  Clock::time_point last_update = created;
  FrameStats stats;
  std::vector<surface::DrawTile> draw_list; ///< of the last frame: the cut and the floor below it

  std::span<const surface::DrawTile> to_draw();
  void update(const view::Camera& camera, const ViewSettings& settings, double upload_ms);
  void ask(const surface::TileRequest& request);
  bool submit(const geo::TileKey& key, Part part);
  void renew_roots();
  void show_surface_at(const ViewSettings& settings);
  SlotAges& ages(Part part) { return part == Part::colour ? slots : meshes; }
  bool is_stale() const { return stale.any || stale_meshes.any; }
  void show_heights();
  void renew_parts();
  void resume_waiting();
  void order_waiting();
  void foresee(const view::Camera& camera, const ViewSettings& settings, Clock::time_point now);
  void take_over(double upload_ms);
  void take_over(Finished item);
  void wait_for_half(Clock::time_point deadline);
  Result<void> upload(const Finished& item);
  bool make_room(Part part);
  Clock::time_point note_failure(const Error& error, std::chrono::seconds pause);
  bool has_given_up();
  Result<surface::TileGeometry> build_bare(const geo::TileKey& key);
  void show_bare(const geo::TileKey& root, surface::TileGeometry bare);
  Result<void> load_roots();
};

std::span<const surface::DrawTile> GlobeView::State::to_draw() {
  if (selection->floor.empty()) return selection->draw;
  draw_list.assign(selection->draw.begin(), selection->draw.end());
  draw_list.insert(draw_list.end(), selection->floor.begin(), selection->floor.end());
  return draw_list;
}

bool GlobeView::State::submit(const geo::TileKey& key, Part part) {
  return globe.try_submit([queue = finished, heights = heights, surface = surface, facts = facts, key, part,
                           token = stop.get_token()](SurfaceWorker& worker) {
    Finished item{key, part, (part == Part::geometry ? heights : surface)->revision, {}};
    if (part == Part::geometry) {
      auto geometry = worker.build_geometry(heights, *facts, key, token);
      if (geometry) item.content = std::move(*geometry);
      else if (geometry.error().code == ErrorCode::pending) item.content = worker.take_awaited();
      else item.content = geometry.error();
    } else {
      auto imagery = worker.build_colour(surface, key, token);
      if (imagery) item.content = std::move(*imagery);
      else if (imagery.error().code == ErrorCode::pending) item.content = worker.take_awaited();
      else item.content = imagery.error();
    }
    queue->push(std::move(item));
  });
}

/// The roots are never asked for again, but must not depend on when the tables came. No more of them are in flight than `finished` has room for.
void GlobeView::State::renew_roots() {
  while (roots_to_renew > 0 && roots_renewing < geo::kFaceCount && submit({static_cast<std::uint8_t>(roots_to_renew - 1), 0, 0, 0}, Part::geometry)) {
    --roots_to_renew;
    ++roots_renewing;
    ++in_flight;
  }
  std::erase_if(roots_to_retry, [&](const auto& retry) {
    if (Clock::now() < retry.second || !submit(retry.first, Part::geometry)) return false;
    ++roots_renewing;
    ++in_flight;
    return true;
  });
}

/// From now on the layers show the steps of the settings' time; what was on its way for the old ones is let go.
void GlobeView::State::show_surface_at(const ViewSettings& settings) {
  auto latest = settings.transitions ? steps.at(globe, settings.time, surface) : globe.surface_at(settings.time);
  if (latest == surface) return;
  slots.layers_changed(*surface, *latest);
  tree.forget_failures(Part::colour);
  surface = std::move(latest);
  const auto shows = [&](surface::ImageUse use) { return std::ranges::find(surface->colours, use, &surface::Layer::use) != surface->colours.end(); };
  renderer->allow(thread, {.overlays = shows(surface::ImageUse::overlay), .normals = shows(surface::ImageUse::normal)});
  std::erase_if(waiting, [&](const WaitingPart& part) {
    if (part.part != Part::colour) return false;
    tree.cancelled(part.key, part.part);
    slots.not_asked(part.key);
    return true;
  });
}

/// A catalogue of heights has changed: the tiles that what came or went touches are built anew.
void GlobeView::State::show_heights() {
  auto latest = globe.surface();
  if (latest == heights) return;
  meshes.layers_changed(*heights, *latest);
  tree.forget_failures(Part::geometry);
  heights = std::move(latest);
  roots_to_renew = geo::kFaceCount;
}

/// Has what is shown and no longer true made anew; it is shown until then.
void GlobeView::State::renew_parts() {
  stale = slots.find(selection->draw, Clock::now());
  stale_meshes = meshes.find(selection->draw, Clock::now());
  for (const Part part : {Part::colour, Part::geometry}) {
    for (const geo::TileKey& key : (part == Part::colour ? stale : stale_meshes).to_ask) {
      if (in_flight >= max_in_flight || waiting.size() >= kMostWaiting || !submit(key, part)) return;
      ages(part).asked(key);
      ++in_flight;
      ++stats.requests;
    }
  }
}

/// Builds those whose data have come; drops those that no recent frame wanted. Roots are always wanted.
void GlobeView::State::resume_waiting() {
  std::erase_if(waiting, [&](const WaitingPart& part) {
    if (*part.missing == 0 && in_flight < max_in_flight && submit(part.key, part.part)) {
      ++in_flight;
      return true;
    }
    const bool renews = ages(part.part).holds(part.key);
    if (renews ? ages(part.part).is_wanted(part.key) : part.key.level == 0 || tree.is_wanted(part.key, part.part)) return false;
    tree.cancelled(part.key, part.part);
    ages(part.part).not_asked(part.key);
    ++stats.requests_cancelled;
    return true;
  });
}

/// What gains most is fetched first, as this frame's camera sees it. Files that several parts wait for count by the best of them.
void GlobeView::State::order_waiting() {
  for (const WaitingPart& part : waiting) {
    for (const auto& arrival : part.awaited) arrival->set_gain(0);
  }
  for (const WaitingPart& part : waiting) {
    const double gain = part.key.level == 0 ? kRootGain : gain_of(part, tree.gain_px(part.key, part.part));
    for (const auto& arrival : part.awaited) arrival->set_gain(std::max(arrival->gain(), gain));
  }
}

/// While all that is wanted is there and the eye moves, what it will want next.
void GlobeView::State::foresee(const view::Camera& camera, const ViewSettings& settings, Clock::time_point now) {
  ahead.clear();
  const auto later = motion.foresee(globe.ellipsoid(), camera, now);
  if (!later || !settings.transitions || selection == nullptr || selection->stats.tiles_waiting > 0) return;
  const auto requests = tree.foresee(*later, selection_of(settings, max_bytes), now);
  ahead.assign(requests.begin(), requests.end());
}

void GlobeView::State::ask(const surface::TileRequest& request) {
  if (!submit(request.key, request.part)) return;
  ++in_flight;
  ++stats.requests;
  tree.started(request.key, request.part);
}

bool GlobeView::State::make_room(Part part) {
  const Part other = part == Part::geometry ? Part::colour : Part::geometry;
  for (const Part p : {part, other}) {
    if (const auto key = tree.eviction_candidate(p)) {
      renderer->release(thread, *key, p);
      tree.released(*key, p);
      ages(p).released(*key);
      return true;
    }
  }
  return false;
}

Result<void> GlobeView::State::upload(const Finished& item) {
  for (;;) {
    auto result = item.part == Part::geometry
                      ? renderer->upload_geometry(thread, item.key, std::get<surface::TileGeometry>(item.content))
                      : renderer->upload_colour(thread, item.key, std::get<surface::TileImagery>(item.content), transitions);
    if (result || result.error().code != ErrorCode::exhausted || !make_room(item.part)) return result;
  }
}

void GlobeView::State::take_over(Finished item) {
  --in_flight;
  SlotAges& age = ages(item.part);
  const bool is_ground_of_root = item.key.level == 0 && item.part == Part::geometry;
  const bool renews = age.holds(item.key);
  const bool current = item.revision == (item.part == Part::colour ? surface : heights)->revision;
  if (renews && !current) return age.not_asked(item.key);  // its own content is no older
  if (is_ground_of_root && !current) {  // nor is a root's, which is asked for anew
    --roots_renewing;
    return;
  }
  if (auto* awaited = std::get_if<source::Awaited>(&item.content)) {
    if (awaited->empty() && (renews || item.key.level > 0)) {  // another part has asked for them
      age.not_asked(item.key);
      return tree.cancelled(item.key, item.part);
    }
    waiting.push_back(waiting_part(item.key, item.part, std::move(*awaited)));
    return;
  }
  if (is_ground_of_root && roots_renewing > 0) --roots_renewing;
  const Error* built_wrong = std::get_if<Error>(&item.content);
  const std::span<const surface::MissingLayer> missing = missing_layers(item);
  if (!missing.empty() && !age.may_lack(item.key, numbers_of(missing))) built_wrong = &missing.front().error;
  const Result<void> result = built_wrong != nullptr ? Result<void>(*built_wrong) : upload(item);
  if (!result) {
    const Error& error = result.error();
    if (renews) age.not_asked(item.key);
    const bool of_other_layers = item.part == Part::colour && !current;
    if (error.code == ErrorCode::cancelled || of_other_layers) return tree.cancelled(item.key, item.part);
    if (error.code == ErrorCode::exhausted && built_wrong == nullptr) {
      // More is wanted than fits: want less from now on. What only a later view wants does not count.
      if (selection == nullptr || selection->stats.tiles_waiting > 0) max_bytes = std::max(max_bytes - max_bytes / 16, kLeastBytes);
      return tree.cancelled(item.key, item.part);
    }
    const auto retry_at = note_failure(error, kPause);
    if (retry_at != Clock::time_point::max() && is_ground_of_root) roots_to_retry.insert_or_assign(item.key, retry_at);
    if (renews) age.failed(item.key, retry_at);
    return tree.failed(item.key, item.part, retry_at);
  }
  if (const auto* geometry = std::get_if<surface::TileGeometry>(&item.content)) tree.arrived_geometry(item.key, geometry->metrics, !geometry->slopes.slopes.empty());
  else tree.arrived_colour(item.key);
  if (missing.empty()) {
    patience.progressed(Clock::now());
    return age.composed(item.key, current);
  }
  const auto retry_at = note_failure(missing.front().error, kPauseWithout);
  age.composed_without(item.key, numbers_of(missing), retry_at);
  if (retry_at != Clock::time_point::max() && is_ground_of_root) roots_to_retry.insert_or_assign(item.key, retry_at);
}

void GlobeView::State::take_over(double upload_ms) {
  const auto start = Clock::now();
  while (auto item = finished->try_pop()) {
    take_over(std::move(*item));
    if (ms_since(start) > upload_ms) break;
  }
}

/// Takes over half of what is in flight: to select anew after every tile would take longer than to build it.
void GlobeView::State::wait_for_half(Clock::time_point deadline) {
  if (in_flight == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // nothing to do until data arrive
    return;
  }
  const int enough = in_flight / 2;
  do {
    globe.run_one();
    auto item = finished->pop_until(deadline);
    if (!item) return;
    take_over(std::move(*item));
  } while (in_flight > enough);
}

void GlobeView::State::update(const view::Camera& camera, const ViewSettings& settings, double upload_ms) {
  thread.empty_graveyard();
  const auto start = Clock::now();
  transitions = settings.transitions;
  renderer->advance_renewals(thread, transitions ? (start - last_update) / surface::kTransitionTime : 1.0f);
  last_update = start;
  globe.run_one();
  take_over(upload_ms);
  resume_waiting();
  stats.upload_ms = ms_since(start);

  show_heights();  // first: the surface shown below is then no older, and stats.complete rests on that
  show_surface_at(settings);
  if (auto latest = globe.facts(); latest != first_facts) {
    first_facts = std::move(latest);
    roots_to_renew = geo::kFaceCount;
  }
  if (auto latest = globe.facts_of(surface); latest != facts) {
    facts = std::move(latest);
    tree.set_facts(facts);
  }
  renew_roots();
  const auto before_select = Clock::now();
  foresee(camera, settings, before_select);
  selection = &tree.select(camera, selection_of(settings, max_bytes), before_select);
  stats.select_ms = ms_since(before_select);

  order_waiting();
  for (const surface::TileRequest& request : selection->requests) {
    if (in_flight >= max_in_flight || waiting.size() >= kMostWaiting) break;
    ask(request);
  }
  renew_parts();
  if (selection->requests.empty() && !is_stale()) {
    for (const surface::TileRequest& request : ahead) {
      if (in_flight >= max_in_flight || waiting.size() >= kMostAhead) break;
      ask(request);
    }
  }

  steps.foresee(globe, settings.time, start, *surface, selection->draw, transitions && selection->requests.empty() && !is_stale());

  const surface::SelectionStats& s = selection->stats;
  stats.time = std::chrono::duration<double>(start - created).count();
  stats.tiles_visited = s.tiles_visited;
  stats.tiles_selected = s.tiles_selected;
  stats.tiles_selected_by_level = s.selected_by_level;
  stats.tiles_drawn = s.tiles_drawn;
  stats.tiles_drawn_by_level = s.drawn_by_level;
  stats.tiles_waiting = s.tiles_waiting;
  stats.max_error_px = s.max_error_px;
  // The globe is asked first whether it is ready, then whether this is what it has: it may have changed since it was looked at above.
  const bool is_latest = globe.tables_ready() && globe.catalogues_ready() && first_facts == globe.facts() && heights == globe.surface();
  stats.complete = s.complete && is_latest && roots_to_renew == 0 && roots_renewing == 0 && roots_to_retry.empty() && !is_stale() && !(transitions && steps.is_behind());
  stats.bytes_uploaded = static_cast<std::int64_t>(renderer->bytes_uploaded());
  stats.memory_cache_bytes = static_cast<std::int64_t>(globe.memory_cache_bytes());
  stats.gpu_cache_bytes = static_cast<std::int64_t>(renderer->gpu_bytes());
  stats.bytes_fetched = globe.fetch_stats().bytes;
  stats.disk_cache_bytes = static_cast<std::int64_t>(globe.disk_cache_bytes());
  stats.draw_ms = 0;
  stats.draws = 0;
  stats.triangles = 0;
  stats.frame_ms = ms_since(start);
}

/// When what failed so may be asked for again.
Clock::time_point GlobeView::State::note_failure(const Error& error, std::chrono::seconds pause) {
  if (error.code != ErrorCode::unavailable) return Clock::time_point::max();
  patience.failed();
  return Clock::now() + pause;
}

/// Whether all that is missing has failed for good, or goes on failing while nothing arrives.
bool GlobeView::State::has_given_up() {
  const auto now = Clock::now();
  patience.received(globe.fetch_stats().bytes, now);
  if (patience.is_over(now)) return true;
  const bool idle = in_flight == 0 && waiting.empty() && roots_to_renew == 0 && roots_to_retry.empty() && selection->requests.empty();
  return idle && !selection->stats.retries_later && !stale.may_change && !stale_meshes.may_change && first_facts == globe.facts() && globe.catalogues_ready();
}

Result<surface::TileGeometry> GlobeView::State::build_bare(const geo::TileKey& key) {
  auto nothing = std::make_shared<surface::SurfaceDescription>();
  nothing->ellipsoid = globe.ellipsoid();
  cache::BlockCache no_blocks(0);
  SurfaceWorker worker(no_blocks);
  return worker.build_geometry(std::move(nothing), *facts, key, {});
}

/// A bare ellipsoid stands in for the ground of a root.
void GlobeView::State::show_bare(const geo::TileKey& root, surface::TileGeometry bare) {
  take_over(Finished{root, Part::geometry, heights->revision, std::move(bare)});
  std::vector<std::uint32_t> all;
  for (const surface::Layer& layer : heights->heights) all.push_back(layer.source_id);
  std::ranges::sort(all);
  meshes.composed_without(root, std::move(all), Clock::time_point::max());
}

Result<void> GlobeView::State::load_roots() {
  const auto deadline = Clock::now() + kRootDeadline;
  // Twelve jobs; without threads they run here.
  int missing = 0;
  for (const Part part : {Part::geometry, Part::colour}) {
    for (int face = 0; face < geo::kFaceCount; ++face) {
      const geo::TileKey root{static_cast<std::uint8_t>(face), 0, 0, 0};
      while (!submit(root, part)) {
        if (!globe.run_one()) std::this_thread::yield();
      }
      tree.started(root, part);
      ++in_flight;
      ++missing;
    }
  }
  std::vector<WaitingPart> late;
  std::array<bool, geo::kFaceCount> has_ground{};
  while (missing > 0) {
    globe.run_one();
    auto item = finished->pop_until(std::min(deadline, Clock::now() + std::chrono::milliseconds(20)));
    if (!item) {
      if (Clock::now() >= deadline) break;
      continue;
    }
    --missing;
    if (item->part == Part::geometry) has_ground[item->key.face] = true;
    if (item->part == Part::geometry && (std::holds_alternative<Error>(item->content) || std::holds_alternative<source::Awaited>(item->content))) {
      // Heights that cannot be read, or not yet, must not leave a hole: a bare ellipsoid stands in.
      auto bare = build_bare(item->key);
      if (!bare) return bare.error();
      if (auto* awaited = std::get_if<source::Awaited>(&item->content)) late.push_back(waiting_part(item->key, item->part, std::move(*awaited)));
      else if (std::get<Error>(item->content).code == ErrorCode::unavailable) roots_to_retry.insert_or_assign(item->key, Clock::now() + kPause);
      show_bare(item->key, std::move(*bare));
      continue;
    }
    take_over(std::move(*item));
  }
  // Those that workers still build come later, too.
  int still_built = 0;
  for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) {
    if (has_ground[face]) continue;
    const geo::TileKey root{face, 0, 0, 0};
    auto bare = build_bare(root);
    if (!bare) return bare.error();
    ++in_flight;  // as the one that is taken over, which nobody was asked for
    show_bare(root, std::move(*bare));
    ++still_built;
  }
  roots_renewing = static_cast<int>(late.size()) + still_built;
  for (WaitingPart& part : late) waiting.push_back(std::move(part));
  return {};
}

GlobeView::GlobeView(std::unique_ptr<State> state) : state_(std::move(state)) {}

GlobeView::~GlobeView() {
  if (!state_) return;
  state_->stop.request_stop();
  state_->finished->close();
}

Result<std::unique_ptr<GlobeView>> GlobeView::create(Globe& globe, gpu::RenderThread& thread, std::size_t gpu_budget_bytes) {
  auto state = std::make_unique<State>(globe, thread);
  render::RendererOptions options;
  options.ellipsoid = globe.ellipsoid();
  options.gpu_budget_bytes = gpu_budget_bytes;
  for (std::size_t i = 0; i < globe.layer_count(); ++i) {
    const LayerGroup group = globe.layer(i).spec.group;
    options.slots.overlays = options.slots.overlays || group == LayerGroup::overlay;
    options.slots.normals = options.slots.normals || group == LayerGroup::normal;
  }
  auto renderer = render::Renderer::create(thread, options);
  if (!renderer) return renderer.error();
  state->renderer = std::move(*renderer);
  // The ancestors of what a picture shows take a third of that again.
  state->max_bytes = std::max(gpu_budget_bytes / 4 * 3, kLeastBytes);
  state->max_in_flight = 4 * std::max(globe.worker_count(), 1);
  state->finished = std::make_shared<FinishedQueue>(static_cast<std::size_t>(state->max_in_flight) + 2 * geo::kFaceCount);
  if (auto roots = state->load_roots(); !roots) return roots.error();
  globe.begin_tables();
  return std::unique_ptr<GlobeView>(new GlobeView(std::move(state)));
}

const FrameStats& GlobeView::update(const view::Camera& camera, const ViewSettings& settings, double upload_ms) {
  state_->update(camera, settings, upload_ms);
  return state_->stats;
}

const FrameStats& GlobeView::draw(const view::Camera& camera, const ViewSettings& settings, unsigned framebuffer, double upload_ms) {
  State& s = *state_;
  const auto start = Clock::now();
  s.update(camera, settings, upload_ms);
  const auto before_draw = Clock::now();
  const auto figures = s.renderer->draw(s.thread, camera, look_of(settings, s.globe.world(), camera), s.to_draw(), framebuffer);
  s.stats.draw_ms = ms_since(before_draw);
  s.stats.draws = figures.draws;
  s.stats.triangles = figures.triangles;
  s.stats.frame_ms = ms_since(start);
  ++s.stats.frame;
  if (s.stats.frame_ms > kFrameBudgetMs) ++s.stats.frames_over_budget;
  return s.stats;
}

bool GlobeView::finish(const view::Camera& camera, const ViewSettings& settings, Clock::time_point deadline) {
  State& s = *state_;
  // Else every raster that a catalogue comes to know would have tiles built anew.
  if (!s.globe.wait_for_catalogues(deadline) || !s.globe.wait_for_tables(deadline)) return false;
  constexpr double kNoLimit = 1e9;
  s.patience.progressed(Clock::now());
  for (;;) {
    s.update(camera, settings, kNoLimit);
    if (s.stats.complete) return true;
    if (s.has_given_up()) return false;
    const auto now = Clock::now();
    if (now >= deadline) return false;
    s.wait_for_half(std::min(deadline, now + std::chrono::milliseconds(50)));
  }
}

raster::Image GlobeView::picture(const view::Camera& camera, const ViewSettings& settings) {
  State& s = *state_;
  s.selection = &s.tree.select(camera, selection_of(settings, s.max_bytes), Clock::now());
  return s.renderer->picture(s.thread, camera, look_of(settings, s.globe.world(), camera), s.to_draw());
}

raster::Image GlobeView::last_picture() { return state_->renderer->last_picture(state_->thread); }

render::GeoPicture GlobeView::measure(const view::Camera& camera, const ViewSettings& settings) {
  State& s = *state_;
  s.selection = &s.tree.select(camera, selection_of(settings, s.max_bytes), Clock::now());
  return s.renderer->measure(s.thread, camera, look_of(settings, s.globe.world(), camera), s.to_draw());
}

bool GlobeView::prepare_switches(const ViewSettings& settings) {
  constexpr bool ViewSettings::*kSwitches[] = {&ViewSettings::lighting, &ViewSettings::atmosphere,   &ViewSettings::wireframe,
                                               &ViewSettings::bounds,   &ViewSettings::tile_borders, &ViewSettings::antialiasing};
  State& s = *state_;
  for (const auto which : kSwitches) {
    ViewSettings switched = settings;
    switched.*which = !(switched.*which);
    if (s.renderer->warm_up(s.thread, look_of(switched, s.globe.world(), view::Camera{}))) return true;
  }
  return false;
}

std::optional<geo::Point<geo::Ecef>> GlobeView::pick(const view::Camera& camera, glm::dvec2 pixel, const ViewSettings& settings) {
  State& s = *state_;
  if (!s.selection) return std::nullopt;
  // A picture of one pixel that looks along the ray.
  const glm::dvec3 direction = camera.ray(pixel).xyz;
  view::Camera narrow = camera;
  const glm::dvec3 right = glm::normalize(glm::cross(direction, camera.axes[1]));
  narrow.axes = glm::dmat3(right, glm::cross(right, direction), -direction);
  narrow.vertical_fov = Radians(camera.pixel_angle());
  narrow.width = narrow.height = 1;
  const auto seen = s.renderer->measure(s.thread, narrow, look_of(settings, s.globe.world(), camera), s.to_draw());
  if (!(seen.distance.front() > 0.0)) return std::nullopt;
  return camera.eye + geo::Vector<geo::Ecef>{direction * seen.distance.front()};
}

std::optional<EllipsoidalHeight> GlobeView::ground_below(const view::Camera& camera) { return state_->ground.find(state_->globe, camera); }

const FrameStats& GlobeView::stats() const { return state_->stats; }
int GlobeView::parts_in_work() const { return state_->in_flight; }
gpu::RenderThread& GlobeView::thread() { return state_->thread; }
render::Renderer& GlobeView::renderer() { return *state_->renderer; }

}  // namespace tellurion::globe
