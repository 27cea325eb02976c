#include "globe/height_tables.h"

#include <algorithm>
#include <mutex>
#include <stop_token>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/hash.h"
#include "base/log.h"
#include "surface/error_scan.h"
#include "surface/error_table.h"
#include "surface/prepared_table.h"

namespace tellurion::globe {
struct HeightTables::State {
  std::shared_ptr<const surface::SurfaceDescription> surface;
  std::shared_ptr<const surface::SurfaceDescription> scanned;
  cache::BlockCache* blocks = nullptr;
  WorkerPool* pool = nullptr;
  Publish publish;
  std::filesystem::path file;  ///< empty: not kept
  std::string revision;
  std::string scan_revision;   ///< of what is scanned
  std::vector<surface::KnownErrors::OfRaster> prepared;  ///< written by load() alone
  std::stop_source stop;
  std::atomic<bool> loaded{false};  ///< or there was none to load
  std::atomic<bool> ready{false};
  std::atomic<bool> begun{false};

  std::mutex mutex;  ///< guards what follows
  std::vector<surface::ElevationModel> idle_models;
  std::vector<surface::SubtreeScan> scans;
  std::size_t unfinished = 0;
  bool failed = false;

  Result<surface::ElevationModel> take_model();
  void run(std::size_t job, const geo::TileKey& root);
  void finish();
  void load_prepared();
  void publish_all(std::shared_ptr<const surface::ErrorTable> table);
};

void HeightTables::State::load_prepared() {
  for (const surface::Layer& layer : surface->heights) {
    if (!surface::wants_prepared_table(*surface, layer)) continue;
    auto table = surface::load_prepared_table(*layer.source, surface->ellipsoid);
    if (table) prepared.push_back({layer.source, std::move(*table)});
    else if (table.error().code != ErrorCode::not_found) log::warning(table.error().message);
  }
}

void HeightTables::State::publish_all(std::shared_ptr<const surface::ErrorTable> table) {
  publish(std::make_shared<const surface::KnownErrors>(surface::KnownErrors{std::move(table), prepared}));
}

Result<surface::ElevationModel> HeightTables::State::take_model() {
  {
    std::lock_guard lock(mutex);
    if (!idle_models.empty()) {
      surface::ElevationModel model = std::move(idle_models.back());
      idle_models.pop_back();
      return model;
    }
  }
  return surface::ElevationModel::open(scanned, *blocks);
}

void HeightTables::State::run(std::size_t job, const geo::TileKey& root) {
  auto model = take_model();
  Result<surface::SubtreeScan> scan = model ? surface::scan_subtree(*model, root, stop.get_token()) : model.error();
  bool last = false;
  {
    std::lock_guard lock(mutex);
    if (model) idle_models.push_back(std::move(*model));
    if (scan) {
      scans[job] = std::move(*scan);
    } else {
      const bool told = std::exchange(failed, true);
      if (!told && scan.error().code != ErrorCode::cancelled)
        log::warning(fmt::format("{}; levels are chosen by estimates", scan.error().message));
    }
    last = --unfinished == 0;
  }
  if (last) finish();
}

void HeightTables::State::finish() {
  std::vector<surface::SubtreeScan> found;
  {
    std::lock_guard lock(mutex);
    found = std::move(scans);
    idle_models.clear();
  }
  if (!failed) {
    auto table = std::make_shared<const surface::ErrorTable>(surface::merge_scans(found));
    if (!file.empty()) {
      std::error_code failure;
      std::filesystem::create_directories(file.parent_path(), failure);
      if (const auto saved = table->save(file, scan_revision); !saved) log::warning(saved.error().message);
    }
    publish_all(std::move(table));
  }
  ready = true;
}

HeightTables::HeightTables(std::shared_ptr<const surface::SurfaceDescription> surface, cache::BlockCache& blocks,
                           std::filesystem::path cache_folder, WorkerPool& pool, Publish publish)
    : state_(std::make_shared<State>()) {
  State& s = *state_;
  s.scanned = std::make_shared<const surface::SurfaceDescription>(surface::scanned_part(*surface));
  s.surface = std::move(surface);
  s.blocks = &blocks;
  s.pool = &pool;
  s.publish = std::move(publish);
  s.revision = surface::errors_revision(*s.surface);
  s.scan_revision = surface::table_revision(*s.surface);
  if (!cache_folder.empty()) s.file = cache_folder / "tables" / fmt::format("{:016x}.errors", fnv1a(s.scan_revision));
}

HeightTables::~HeightTables() { state_->stop.request_stop(); }

void HeightTables::load(bool scan) {
  State& s = *state_;
  s.load_prepared();
  const bool all_prepared = std::ranges::all_of(s.surface->heights, [&](const surface::Layer& layer) {
    return !layer.enabled || std::ranges::find(s.prepared, layer.source, &surface::KnownErrors::OfRaster::raster) != s.prepared.end();
  });
  auto kept = s.file.empty() || all_prepared ? Result<surface::ErrorTable>(Error{ErrorCode::not_found, ""}) : surface::ErrorTable::load(s.file, s.scan_revision);
  if (kept) s.publish_all(std::make_shared<const surface::ErrorTable>(std::move(*kept)));
  else if (!s.prepared.empty()) s.publish_all(nullptr);
  if (kept || (all_prepared && !s.prepared.empty()) || !scan) s.ready = true;
  s.loaded = true;
}

void HeightTables::begin_scan() {
  State& s = *state_;
  if (!s.loaded || s.ready || s.begun.exchange(true)) return;
  const std::vector<geo::TileKey> jobs = surface::scan_jobs();
  s.scans.resize(jobs.size());
  s.unfinished = jobs.size();
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    s.pool->submit_background([state = state_, i, root = jobs[i]](int) { state->run(i, root); });
  }
}

const std::string& HeightTables::revision() const { return state_->revision; }
bool HeightTables::ready() const { return state_->ready; }

}  // namespace tellurion::globe
