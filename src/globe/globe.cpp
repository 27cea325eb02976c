#include "globe/globe.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "cache/block_cache.h"
#include "globe/height_tables.h"
#include "globe/kept_files.h"
#include "globe/layer_catalogue.h"
#include "globe/layer_source.h"
#include "globe/resident_heights.h"
#include "globe/surface_steps.h"
#include "globe/surface_worker.h"
#include "globe/worker_pool.h"
#include "fetch/byte_store.h"
#include "source/catalogue/catalogue.h"
#include "source/gdal/gdal_source.h"
#include "surface/error_scan.h"
#include "surface/surface_facts_made.h"

namespace tellurion::globe {
namespace {

constexpr std::size_t kWaitingJobs = 64;

int default_worker_count() {
  // One core is left to the render thread and the embedding program.
  return std::max(static_cast<int>(std::thread::hardware_concurrency()) - 1, 1);
}

}  // namespace

std::filesystem::path default_cache_folder() {
  if (const char* set = std::getenv("XDG_CACHE_HOME"); set && *set) return std::filesystem::path(set) / "tellurion";
  if (const char* home = std::getenv("HOME"); home && *home) return std::filesystem::path(home) / ".cache" / "tellurion";
  return {};
}

namespace {

/// A layer while its world is open.
struct OpenLayer {
  LayerInfo info;  ///< never changes
  // Guarded by the globe's mutex:
  SourceStats stats{};
  std::string error{};                           ///< why it could not be opened
  std::shared_ptr<LayerCatalogue> catalogue{};   ///< null: of another type, not opened yet, or removed
  bool opened = false;                           ///< or tried, or a worker does
  bool removed = false;
};

}  // namespace

/// What servers sent lies in the disk cache: it is decoded again where it is needed again.
constexpr std::size_t kCheapShare = 16;

struct Globe::State {
  State(World w, const GlobeOptions& o)
      : world(std::move(w)),
        options(o),
        // GDAL's own block cache takes a quarter of the budget.
        blocks(o.memory_cache_bytes - o.memory_cache_bytes / 4, o.cache_folder.empty() ? o.memory_cache_bytes : o.memory_cache_bytes / kCheapShare) {
    kept.file = world.file;
    for (std::size_t i = 0; !kept.file.empty() && i < world.layers.size(); ++i) kept.layers.insert(i);
  }

  World world;
  GlobeOptions options;
  cache::BlockCache blocks;
  std::shared_ptr<fetch::ByteStore> store;  ///< null: no layer needs it
  std::unique_ptr<SurfaceSteps> steps;
  std::atomic<std::uint32_t> next_data_set{1u << 31};       ///< number of the next data set of a catalogue: layers have small ones
  std::mutex store_mutex;                                   ///< guards `store` while it is made
  std::mutex keeping;                                       ///< held while `kept` is changed, as long as that takes

  mutable std::mutex mutex;  ///< guards what follows
  std::shared_ptr<const surface::SurfaceDescription> surface;
  std::shared_ptr<const surface::KnownErrors> errors;
  std::shared_ptr<const surface::SurfaceFacts> facts;
  std::vector<std::pair<std::shared_ptr<const surface::SurfaceDescription>, std::shared_ptr<const surface::SurfaceFacts>>> other_facts;  ///< of other times
  std::deque<OpenLayer> layers;        ///< stay where they are
  KeptLayers kept;
  int opening = 0;                     ///< jobs in which workers open layers
  std::shared_ptr<HeightTables> tables;

  ResidentHeights resident{[this](std::function<void(SurfaceWorker&)> work) { return submit(std::move(work)); }};
  std::vector<std::unique_ptr<SurfaceWorker>> workers;
  std::unique_ptr<WorkerPool> pool;  ///< last: its threads end before what they use

  bool submit(std::function<void(SurfaceWorker&)> work) {
    return pool->try_submit([this, work = std::move(work)](int worker) { work(*workers[static_cast<std::size_t>(worker)]); });
  }
  std::shared_ptr<fetch::ByteStore> needed_store();
  Result<std::unique_ptr<source::RasterSource>> open_source(const LayerSpec& spec);
  Result<std::shared_ptr<const source::RasterSource>> open_raster(const LayerSpec& spec);
  Result<std::unique_ptr<LayerCatalogue>> open_catalogue(const LayerSpec& spec, std::size_t layer);
  void open_layers();
  void submit_opening(std::function<void()> work);
  void open_later(std::size_t layer);
  Result<void> open_layer(std::size_t layer);
  void note_opened(std::size_t layer, const Result<void>& opened);
  std::size_t append(const LayerSpec& spec, bool opened);
  Result<void> remove(std::size_t layer);
  Result<std::size_t> add_data(const std::string& data);
  std::string free_name(const std::string& name);
  void show_changed();
  void show(std::shared_ptr<const surface::SurfaceDescription> changed);
  std::shared_ptr<HeightTables> make_tables();
  std::shared_ptr<HeightTables> current_tables();
  OpenLayer& layer_at(std::size_t layer);
  std::shared_ptr<LayerCatalogue> catalogue_at(std::size_t layer);
  Result<std::shared_ptr<LayerCatalogue>> catalogue_to_change(std::size_t layer);
};

/// The store of bytes, made for the first layer that needs it.
std::shared_ptr<fetch::ByteStore> Globe::State::needed_store() {
  std::lock_guard lock(store_mutex);
  if (!store) {
    fetch::StoreOptions how;
    if (!options.cache_folder.empty()) how.disk_file = kept_database(options.cache_folder);
    how.disk_bytes = options.disk_cache_bytes;
    how.offline = options.offline;
    store = std::make_shared<fetch::ByteStore>(how);
  }
  return store;
}

Result<std::unique_ptr<source::RasterSource>> Globe::State::open_source(const LayerSpec& spec) {
  return open_layer_source(spec, world.ellipsoid, options.cache_folder, [this] { return needed_store(); });
}

/// What a layer without times shows.
Result<std::shared_ptr<const source::RasterSource>> Globe::State::open_raster(const LayerSpec& spec) {
  if (spec.source.raster) return spec.source.raster;
  auto source = open_source(spec);
  if (!source) return source.error();
  return std::shared_ptr<const source::RasterSource>(std::move(*source));
}

Result<std::unique_ptr<LayerCatalogue>> Globe::State::open_catalogue(const LayerSpec& spec, std::size_t layer) {
  LayerCatalogue::Setting setting;
  setting.layer = spec;
  setting.world = world.ellipsoid;
  setting.cache_folder = options.cache_folder;
  setting.open = [this](const LayerSpec& one) { return open_source(one); };
  setting.next_id = [this] { return next_data_set++; };
  setting.look_into_more = [this, layer] {
    pool->submit_background([this, layer](int) {
      if (const auto catalogue = catalogue_at(layer)) catalogue->examine_some();
    });
  };
  setting.publish = [this, layer](std::shared_ptr<const source::Catalogue> catalogue) {
    steps->set_catalogue(layer, std::move(catalogue));
    show_changed();
  };
  return LayerCatalogue::open(std::move(setting));
}

/// What the layers are now is shown; where files have to be opened for that, by a worker.
void Globe::State::show_changed() {
  if (auto held = steps->held_at(options.time)) return show(std::move(held));
  submit_opening([this] { show(steps->at(options.time)); });
}

/// Nothing if something newer is shown.
void Globe::State::show(std::shared_ptr<const surface::SurfaceDescription> changed) {
  std::shared_ptr<HeightTables> begun;
  {
    std::lock_guard lock(mutex);
    if (changed->revision <= surface->revision) return;
    surface = std::move(changed);
    if (surface::errors_revision(*surface) != tables->revision()) {
      errors = nullptr;
      begun = tables = make_tables();
    }
    facts = surface::make_facts(surface, errors);
    other_facts.clear();
  }
  if (!begun) return;
  const WorkerPool::Job load = [begun = std::weak_ptr(begun), scan = options.scan_heights](int) {
    const auto still_wanted = begun.lock();
    if (!still_wanted) return;  // heights have changed again
    still_wanted->load(scan);
    still_wanted->begin_scan();
  };
  // Soon: until it is there, finer tiles are built than are needed.
  if (!pool->try_submit(load)) pool->submit_background(load);
}

/// Error tables for the heights as they are now. With the lock held.
std::shared_ptr<HeightTables> Globe::State::make_tables() {
  return std::make_shared<HeightTables>(surface, blocks, options.cache_folder, *pool,
                                        [this, revision = surface::errors_revision(*surface)](std::shared_ptr<const surface::KnownErrors> found) {
    std::lock_guard lock(mutex);
    if (revision != tables->revision()) return;  // heights have changed since
    errors = std::move(found);
    facts = surface::make_facts(surface, errors);
    other_facts.clear();
  });
}

std::shared_ptr<HeightTables> Globe::State::current_tables() {
  std::lock_guard lock(mutex);
  return tables;
}

OpenLayer& Globe::State::layer_at(std::size_t layer) {
  std::lock_guard lock(mutex);
  return layers[layer];
}

std::shared_ptr<LayerCatalogue> Globe::State::catalogue_at(std::size_t layer) {
  std::lock_guard lock(mutex);
  return layers[layer].catalogue;
}

/// Has a worker open something; catalogues_ready() waits for it.
void Globe::State::submit_opening(std::function<void()> work) {
  {
    std::lock_guard lock(mutex);
    ++opening;
  }
  pool->submit_background([this, work = std::move(work)](int) {
    work();
    std::lock_guard lock(mutex);
    --opening;
  });
}

/// Has a worker open a layer that was off or is new.
void Globe::State::open_later(std::size_t layer) {
  {
    std::lock_guard lock(mutex);
    if (std::exchange(layers[layer].opened, true)) return;
  }
  submit_opening([this, layer] {
    note_opened(layer, open_layer(layer));
  });
}

void Globe::State::note_opened(std::size_t layer, const Result<void>& opened) {
  std::lock_guard lock(mutex);
  OpenLayer& one = layers[layer];
  one.stats.errors = opened ? 0 : 1;
  one.stats.last_error = one.error = opened ? std::string() : opened.error().message;
}

/// Opens and shows it, unless it has been removed.
Result<void> Globe::State::open_layer(std::size_t layer) {
  const LayerSpec& spec = layer_at(layer).info.spec;
  if (spec.source.type == "catalogue") {
    auto opened = open_catalogue(spec, layer);
    if (!opened) return opened.error();
    const std::shared_ptr<LayerCatalogue> catalogue = std::move(*opened);
    {
      std::lock_guard lock(mutex);
      if (layers[layer].removed) return {};
      layers[layer].catalogue = catalogue;
    }
    catalogue->begin();
    return {};
  }
  if (!spec.source.time) {
    auto raster = open_raster(spec);
    if (!raster) return raster.error();
    steps->set_source(layer, std::move(*raster));
  }
  show_changed();
  return {};
}

void Globe::State::open_layers() {
  std::vector<LayerInfo> infos;
  for (const LayerSpec& spec : world.layers) {
    OpenLayer layer{.info = {.spec = spec, .raster = nullptr, .error = {}}, .opened = spec.enabled || spec.source.type == "catalogue" || spec.source.time};
    LayerInfo& info = layer.info;
    layer.stats.name = spec.name;
    const auto fail = [&](const Error& error) {
      const std::string place = spec.line > 0 ? fmt::format("{}:{}: ", world.file.string(), spec.line) : "";
      layer.stats.errors = 1;
      layer.stats.last_error = layer.error = info.error = place + error.message;
    };
    if (spec.source.type == "catalogue") {
      if (auto catalogue = open_catalogue(spec, layers.size())) {
        layer.catalogue = std::move(*catalogue);
        info.catalogue = layer.catalogue->current();
      } else if (spec.enabled) {
        fail(catalogue.error());
      }
    } else if (spec.enabled && !spec.source.time) {
      if (auto raster = open_raster(spec)) info.raster = std::move(*raster);
      else fail(raster.error());
    }
    infos.push_back(info);
    layers.push_back(std::move(layer));
  }
  steps = std::make_unique<SurfaceSteps>(world.ellipsoid, infos, [this](const LayerSpec& spec) { return open_source(spec); });
  surface = steps->at(options.time);
  for (std::size_t i = 0; i < layers.size(); ++i) layers[i].info.raster = steps->raster_at(i, options.time);
}

// --- Layers that come and go -----------------------------------------------------------------------------------------

std::size_t Globe::State::append(const LayerSpec& spec, bool opened) {
  std::lock_guard lock(mutex);
  OpenLayer layer{.info = {.spec = spec, .raster = nullptr, .error = {}}, .opened = opened};
  layer.info.spec.line = 0;
  layer.stats.name = spec.name;
  layers.push_back(std::move(layer));
  return steps->add(spec);
}

Result<void> Globe::State::remove(std::size_t layer) {
  std::shared_ptr<LayerCatalogue> catalogue;  // goes when the lock has gone
  {
    std::lock_guard lock(mutex);
    if (layer >= layers.size() || layers[layer].removed) return {ErrorCode::invalid_argument, fmt::format("there is no layer {} to remove", layer)};
    layers[layer].removed = true;
    catalogue = std::move(layers[layer].catalogue);
  }
  steps->remove(layer);
  show_changed();
  return {};
}

/// Worker side.
Result<std::size_t> Globe::State::add_data(const std::string& data) {
  const auto world_of = world_of_data(data);
  if (!world_of) return world_of.error();
  auto spec = layer_for(world, *world_of);
  if (!spec) return spec.error();
  spec->name = free_name(spec->name);
  const std::size_t layer = append(*spec, true);
  if (const Result<void> opened = open_layer(layer); !opened) {
    (void)remove(layer);
    return opened.error();
  }
  return layer;
}

/// `name`, with a number behind it if a layer has it.
std::string Globe::State::free_name(const std::string& name) {
  std::lock_guard lock(mutex);
  std::string free = name;
  const auto is_taken = [&] { return std::ranges::any_of(layers, [&](const OpenLayer& layer) { return !layer.removed && layer.info.spec.name == free; }); };
  for (int n = 2; is_taken(); ++n) free = fmt::format("{} {}", name, n);
  return free;
}

Globe::Globe(std::unique_ptr<State> state) : state_(std::move(state)) {}
Globe::~Globe() = default;

Result<std::unique_ptr<Globe>> Globe::open(World world, const GlobeOptions& options) {
  source::configure_gdal(options.memory_cache_bytes / 4);
  auto state = std::make_unique<State>(std::move(world), options);
  state->open_layers();
  const int threads = options.workers < 0 ? default_worker_count() : options.workers;
  std::unique_ptr<Globe> globe(new Globe(std::move(state)));
  State& s = *globe->state_;
  for (int i = 0; i < std::max(threads, 1); ++i) s.workers.push_back(std::make_unique<SurfaceWorker>(s.blocks));
  s.pool = std::make_unique<WorkerPool>(threads, kWaitingJobs);
  s.tables = s.make_tables();
  s.facts = surface::make_facts(s.surface, nullptr);
  s.tables->load(options.scan_heights);
  for (std::size_t i = 0; i < s.layers.size(); ++i) {
    if (s.layers[i].catalogue && s.world.layers[i].enabled) s.layers[i].catalogue->begin();
  }
  return globe;
}

const World& Globe::world() const { return state_->world; }
const geo::Ellipsoid& Globe::ellipsoid() const { return state_->world.ellipsoid; }
const LayerInfo& Globe::layer(std::size_t layer) const { return state_->layer_at(layer).info; }

std::size_t Globe::layer_count() const {
  std::lock_guard lock(state_->mutex);
  return state_->layers.size();
}

std::shared_ptr<const source::RasterSource> Globe::raster_at(std::size_t layer, const std::optional<UtcTime>& time) const { return state_->steps->raster_at(layer, time); }
std::string Globe::step_of(std::size_t layer, const std::optional<UtcTime>& time) const { return state_->steps->text_of(layer, time); }

std::shared_ptr<const source::RasterSource> Globe::shown_raster(std::size_t layer) const {
  const LayerInfo& info = this->layer(layer);
  return info.spec.source.time ? info.raster : state_->steps->raster_at(layer, {});
}

std::vector<std::string> Globe::hints() const {
  std::vector<std::string> hints;
  for (std::size_t i = 0; i < layer_count(); ++i) {
    {
      std::lock_guard lock(state_->mutex);
      if (state_->layers[i].removed) continue;
      if (!state_->layers[i].error.empty()) hints.push_back(state_->layers[i].error);
    }
    const auto raster = shown_raster(i);
    if (!raster) continue;
    const auto& more = raster->description().hints;
    hints.insert(hints.end(), more.begin(), more.end());
  }
  return hints;
}

std::vector<std::string> Globe::problems() const {
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i < layer_count(); ++i) {
    const auto catalogue = state_->catalogue_at(i);
    if (!catalogue) continue;
    const LayerCatalogue::Problems found = catalogue->problems();
    sentences.insert(sentences.end(), found.sentences.begin(), found.sentences.end());
    const auto told = static_cast<std::int64_t>(found.sentences.size());
    if (found.count > told) sentences.push_back(fmt::format("and {} more rasters of a catalogue were left out", found.count - told));
  }
  return sentences;
}

std::vector<SourceStats> Globe::source_stats() const {
  std::vector<SourceStats> all;
  {
    std::lock_guard lock(state_->mutex);
    for (const OpenLayer& layer : state_->layers) all.push_back(layer.stats);
  }
  for (std::size_t layer = 0; layer < all.size(); ++layer) {
    for (const std::uint32_t id : state_->steps->source_ids(layer)) {
      cache::SourceReads reads = state_->blocks.reads_of(id);
      all[layer].requests += reads.blocks + reads.errors;
      all[layer].bytes += reads.bytes;
      all[layer].errors += reads.errors;
      if (reads.errors > 0) all[layer].last_error = std::move(reads.last_error);
    }
    const SurfaceSteps::Failures failures = state_->steps->failures_of(layer);
    all[layer].errors += failures.count;
    if (failures.count > 0) all[layer].last_error = failures.last_error;
    if (const auto catalogue = state_->catalogue_at(layer)) {
      const LayerCatalogue::Problems problems = catalogue->problems();
      const source::OpenDataSets::Failures unopened = catalogue->current()->open_sets()->failures();
      all[layer].errors += problems.count + unopened.count;
      if (!problems.sentences.empty()) all[layer].last_error = problems.sentences.back();
      if (unopened.count > 0) all[layer].last_error = unopened.last_error;
    }
  }
  return all;
}

bool Globe::data_missing() const {
  const auto cannot_be_opened = [&](std::size_t layer) {
    std::lock_guard lock(state_->mutex);
    return state_->layers[layer].stats.errors > 0;
  };
  for (std::size_t layer = 0; layer < layer_count(); ++layer) {
    if (!layer_settings(layer).enabled) continue;
    if (cannot_be_opened(layer) || state_->steps->failures_of(layer).count > 0) return true;
    const auto catalogue = state_->catalogue_at(layer);
    if (catalogue && (catalogue->problems().count > 0 || catalogue->current()->open_sets()->failures().count > 0)) return true;
    for (const std::uint32_t id : state_->steps->source_ids(layer)) {
      if (state_->blocks.reads_of(id).lost > 0) return true;
    }
  }
  return false;
}

std::size_t Globe::memory_cache_bytes() const { return state_->blocks.bytes() + source::gdal_cache_bytes(); }
std::size_t Globe::disk_cache_bytes() const { return state_->store ? state_->store->disk_bytes() : 0; }
fetch::FetchStats Globe::fetch_stats() const { return state_->store ? state_->store->stats() : fetch::FetchStats{}; }
std::size_t Globe::memory_budget_bytes() const { return state_->options.memory_cache_bytes; }

Result<std::shared_ptr<LayerCatalogue>> Globe::State::catalogue_to_change(std::size_t layer) {
  std::lock_guard lock(mutex);
  if (layer < layers.size() && layers[layer].catalogue) return layers[layer].catalogue;
  const bool may_come = layer < layers.size() && !layers[layer].removed && layers[layer].error.empty() && layers[layer].info.spec.source.type == "catalogue";
  if (may_come) return Error{ErrorCode::unavailable, fmt::format("layer {} is not open yet: rasters cannot be put into it or taken out", layer)};
  return Error{ErrorCode::invalid_argument, fmt::format("layer {} is no catalogue: rasters cannot be put into it or taken out", layer)};
}

Result<void> Globe::insert(std::size_t layer, const std::vector<std::string>& rasters) {
  const auto catalogue = state_->catalogue_to_change(layer);
  if (!catalogue) return catalogue.error();
  (*catalogue)->insert(rasters);
  return {};
}

Result<void> Globe::remove(std::size_t layer, const std::vector<std::string>& rasters) {
  const auto catalogue = state_->catalogue_to_change(layer);
  if (!catalogue) return catalogue.error();
  (*catalogue)->remove(rasters);
  return {};
}

std::shared_ptr<const source::Catalogue> Globe::catalogue_of(std::size_t layer) const {
  const auto catalogue = state_->catalogue_at(layer);
  return catalogue ? catalogue->current() : nullptr;
}

std::size_t Globe::rasters_to_look_into(std::size_t layer) const {
  const auto catalogue = state_->catalogue_at(layer);
  return catalogue ? catalogue->unexamined() : 0;
}

bool Globe::catalogues_ready() const {
  {
    std::lock_guard lock(state_->mutex);
    if (state_->opening > 0) return false;
  }
  for (std::size_t i = 0; i < layer_count(); ++i) {
    const auto catalogue = state_->catalogue_at(i);
    if (catalogue && catalogue->unexamined() > 0 && layer_settings(i).enabled) return false;
  }
  return true;
}

LayerSettings Globe::layer_settings(std::size_t layer) const { return state_->steps->settings(layer); }
std::vector<std::size_t> Globe::layer_order() const { return state_->steps->order(); }

Result<void> Globe::set_layer(std::size_t layer, const LayerSettings& settings) {
  State& s = *state_;
  {
    std::lock_guard lock(s.mutex);
    if (layer >= s.layers.size()) return {ErrorCode::invalid_argument, fmt::format("there is no layer {}: the world has {}", layer, s.layers.size())};
    if (s.layers[layer].removed) return {ErrorCode::invalid_argument, fmt::format("layer {} has been removed", layer)};
  }
  const LayerSpec& spec = s.layer_at(layer).info.spec;
  if (Result<void> fine = check(settings, spec.group); !fine) return {ErrorCode::invalid_argument, fmt::format("layer \"{}\": {}", spec.name, fine.error().message)};
  const LayerSettings before = s.steps->settings(layer);
  if (settings == before) return {};
  s.steps->set_settings(layer, settings);
  if (settings.enabled && !before.enabled) {
    s.open_later(layer);
    if (const auto catalogue = s.catalogue_at(layer)) catalogue->begin();
  }
  s.show_changed();
  return {};
}

bool Globe::move_layer(std::size_t layer, bool up) {
  if (layer >= layer_count() || !state_->steps->move(layer, up)) return false;
  state_->show_changed();
  return true;
}

Result<std::size_t> Globe::add_layer(const LayerSpec& spec) {
  if (Result<void> fine = check(spec, spec.group); !fine) return Error{ErrorCode::invalid_argument, fmt::format("layer \"{}\": {}", spec.name, fine.error().message)};
  const std::size_t layer = state_->append(spec, false);
  if (spec.enabled) state_->open_later(layer);
  return layer;
}

Result<void> Globe::remove_layer(std::size_t layer) { return state_->remove(layer); }

Result<void> Globe::refresh_layer(std::size_t layer) {
  State& s = *state_;
  {
    std::lock_guard lock(s.mutex);
    if (layer >= s.layers.size() || s.layers[layer].removed) return {ErrorCode::invalid_argument, fmt::format("there is no layer {} to refresh", layer)};
    if (s.layers[layer].info.spec.source.type == "catalogue")
      return {ErrorCode::invalid_argument, fmt::format("layer {} is a catalogue: insert its rasters again to have them read anew", layer)};
    if (!s.layers[layer].opened) return {};  // is opened, and read, when it is switched on
  }
  const LayerSpec& spec = s.layer_at(layer).info.spec;
  if (spec.source.time) {
    s.steps->reopen_steps(layer);
    s.show_changed();
  } else if (spec.source.raster) {
    s.steps->set_source(layer, spec.source.raster);
    s.show_changed();
  } else {
    s.submit_opening([&s, layer] { s.note_opened(layer, s.open_layer(layer)); });
  }
  return {};
}

void Globe::add_data(std::vector<std::string> data, std::function<void(const std::vector<AddedData>&)> done) {
  state_->submit_opening([s = state_.get(), data = std::move(data), done = std::move(done)] {
    std::vector<AddedData> added;
    for (const std::string& one : data) added.push_back({one, s->add_data(one)});
    done(added);
  });
}

KeptLayers Globe::kept_layers() const {
  std::lock_guard lock(state_->mutex);
  return state_->kept;
}

Result<void> Globe::change_kept_layers(const std::function<Result<void>(KeptLayers&)>& change) {
  std::lock_guard one_at_a_time(state_->keeping);
  KeptLayers kept = kept_layers();
  if (Result<void> changed = change(kept); !changed) return changed;
  std::lock_guard lock(state_->mutex);
  state_->kept = std::move(kept);
  return {};
}

bool Globe::tables_ready() const { return state_->current_tables()->ready(); }

void Globe::begin_tables() {
  (void)resident_heights();
  state_->current_tables()->begin_scan();
}

bool Globe::wait_for_tables(std::chrono::steady_clock::time_point deadline) {
  begin_tables();
  while (!tables_ready()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    if (!run_one()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

std::shared_ptr<const surface::SurfaceDescription> Globe::surface() const {
  std::lock_guard lock(state_->mutex);
  return state_->surface;
}

std::shared_ptr<const surface::SurfaceFacts> Globe::facts() const {
  std::lock_guard lock(state_->mutex);
  return state_->facts;
}

std::shared_ptr<const surface::SurfaceDescription> Globe::surface_at(const std::optional<UtcTime>& time) const { return state_->steps->at(time); }
std::shared_ptr<const surface::SurfaceDescription> Globe::held_surface_at(const std::optional<UtcTime>& time) const { return state_->steps->held_at(time); }

std::shared_ptr<const surface::SurfaceFacts> Globe::facts_of(const std::shared_ptr<const surface::SurfaceDescription>& surface) const {
  State& s = *state_;
  std::lock_guard lock(s.mutex);
  if (surface == s.surface) return s.facts;
  const auto found = std::ranges::find(s.other_facts, surface, [](const auto& entry) { return entry.first; });
  if (found != s.other_facts.end()) return found->second;
  if (s.other_facts.size() >= SurfaceSteps::kHeldSurfaces) s.other_facts.erase(s.other_facts.begin());
  s.other_facts.emplace_back(surface, surface::make_facts(surface, s.errors));
  return s.other_facts.back().second;
}

bool Globe::try_submit(std::function<void(SurfaceWorker&)> work) { return state_->submit(std::move(work)); }

bool Globe::try_submit_at(const std::optional<UtcTime>& time,
                          std::function<void(SurfaceWorker&, const std::shared_ptr<const surface::SurfaceDescription>&)> work) {
  return try_submit([&steps = *state_->steps, time, work = std::move(work)](SurfaceWorker& worker) { work(worker, steps.at(time)); });
}

bool Globe::run_one() { return state_->pool->run_one(); }
int Globe::worker_count() const { return state_->pool->worker_count(); }

bool Globe::wait_for_catalogues(std::chrono::steady_clock::time_point deadline) {
  while (!catalogues_ready()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    if (!run_one()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

Result<HeightSampler> Globe::height_sampler() const {
  return HeightSampler::open(*this, state_->blocks, [s = state_.get()](std::function<void(SurfaceWorker&)> work) { return s->submit(std::move(work)); });
}
std::shared_ptr<const surface::GlobalHeights> Globe::resident_heights() const { return state_->resident.of(surface()); }

}  // namespace tellurion::globe
