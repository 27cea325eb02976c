#include "globe/layer_catalogue.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <iterator>
#include <mutex>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "source/catalogue/footprint_store.h"
#include "source/catalogue/listing.h"

namespace tellurion::globe {
namespace {

constexpr std::size_t kMostSentences = 5;
constexpr std::chrono::milliseconds kExamination{200};  ///< of one job; then what was found shows

bool is_web_address(const std::string& path) { return path.starts_with("http://") || path.starts_with("https://"); }

/// As lists name it.
std::string whole_path(const std::string& path) {
  std::error_code failure;
  return is_web_address(path) ? path : std::filesystem::absolute(path, failure).lexically_normal().string();
}

/// The layer as if it had but this one raster.
LayerSpec spec_of_raster(const LayerSpec& layer, const std::string& path) {
  LayerSpec spec = layer;
  spec.source.catalogue = {};
  const bool remote = is_web_address(path);
  spec.source.type = remote ? "cog" : "gdal";
  spec.source.url = remote ? path : "";
  spec.source.path = remote ? "" : path;
  return spec;
}

/// Changes when the file does, or how it is opened.
std::string revision_of(const LayerSpec& layer, const std::string& path) {
  std::string revision = layer.source.crs.value_or("");
  if (is_web_address(path)) return revision;
  std::error_code failure;
  const auto size = std::filesystem::file_size(path, failure);
  const auto time = std::filesystem::last_write_time(path, failure);
  if (failure) return {};
  return fmt::format("{}|{}|{}", revision, size, time.time_since_epoch().count());
}

/// Of a raster whose outline has no places: its bounds stand for it.
std::vector<geo::LatLon> ring_of_bounds(const geo::GeodeticBounds& b) {
  const geo::LatLon corners[4] = {{b.north, b.west}, {b.north, b.east}, {b.south, b.east}, {b.south, b.west}};
  std::vector<geo::LatLon> ring;
  for (std::size_t edge = 0; edge < 4; ++edge) {
    const geo::LatLon &from = corners[edge], &to = corners[(edge + 1) % 4];
    for (int i = 0; i < source::kRingSteps; ++i) {
      const double t = static_cast<double>(i) / source::kRingSteps;
      ring.push_back({Radians(std::lerp(from.latitude.value, to.latitude.value, t)), Radians(std::lerp(from.longitude.value, to.longitude.value, t))});
    }
  }
  return ring;
}

}  // namespace

struct LayerCatalogue::State {
  explicit State(Setting s) : setting(std::move(s)) {}

  Setting setting;
  std::unique_ptr<source::FootprintStore> kept;   ///< null: there is none

  mutable std::mutex mutex;  ///< guards what follows; not held while a raster is looked into
  std::shared_ptr<const source::Catalogue> catalogue;
  std::deque<std::pair<std::string, std::int64_t>> unexamined;   ///< path and place in the list
  std::int64_t next_place = 0;
  Problems problems;
  bool begun = false;

  void add_problem(const std::string& sentence) {
    ++problems.count;
    if (problems.sentences.size() < kMostSentences) problems.sentences.push_back(sentence);
  }
  source::Catalogue::Sets::value_type data_set(const std::string& path, std::int64_t place, const std::vector<geo::LatLon>& ring, Metres spacing) const {
    return std::make_shared<const source::DataSet>(source::DataSet{setting.next_id(), path, place, source::Footprint(ring, spacing, setting.world)});
  }
  Result<source::KeptFootprint> look_into(const std::string& path) const;
  /// Makes the catalogue anew and hands it on.
  void change(source::Catalogue::Sets more, const std::vector<std::string>& gone);
};

Result<source::KeptFootprint> LayerCatalogue::State::look_into(const std::string& path) const {
  const auto source = setting.open(spec_of_raster(setting.layer, path));
  if (!source) return source.error();
  auto reader = (*source)->open_reader();
  if (!reader) return reader.error();
  const source::RasterDescription& about = (*source)->description();
  source::KeptFootprint found{source::ring_of_raster(**reader, about.levels.front()), about.spacing};
  if (found.ring.empty()) found.ring = ring_of_bounds(about.bounds);
  if (!(found.spacing.value > 0.0) || !std::isfinite(found.spacing.value))
    return Error{ErrorCode::unsupported, fmt::format("{}: where its middle lies cannot be told", path)};
  return found;
}

void LayerCatalogue::State::change(source::Catalogue::Sets more, const std::vector<std::string>& gone) {
  std::lock_guard lock(mutex);
  std::set<std::string> paths(gone.begin(), gone.end());
  for (const auto& set : more) paths.insert(set->path);
  std::vector<std::uint32_t> ids;
  for (const auto& set : catalogue->sets()) {
    if (paths.contains(set->path)) ids.push_back(set->id);
  }
  if (more.empty() && ids.empty()) return;
  std::ranges::sort(ids);
  catalogue = catalogue->changed(std::move(more), ids);
  if (begun) setting.publish(catalogue);
}

LayerCatalogue::LayerCatalogue(std::unique_ptr<State> state) : state_(std::move(state)) {}
LayerCatalogue::~LayerCatalogue() = default;

Result<std::unique_ptr<LayerCatalogue>> LayerCatalogue::open(Setting setting) {
  auto state = std::make_unique<State>(std::move(setting));
  State& s = *state;
  const LayerSpec& layer = s.setting.layer;
  source::RasterList list;
  if (!layer.source.path.empty()) {
    auto listed = source::list_rasters(layer.source.path, s.setting.world);
    if (!listed) return listed.error();
    list = std::move(*listed);
  }
  for (const std::string& file : layer.source.catalogue.files) list.rasters.push_back({file, {}, Metres(0)});
  for (const std::string& problem : list.problems) s.add_problem(problem);
  if (!s.setting.cache_folder.empty()) {
    std::error_code failure;
    std::filesystem::create_directories(s.setting.cache_folder, failure);
    auto kept = source::FootprintStore::open(s.setting.cache_folder / "footprints.sqlite");
    if (kept) s.kept = std::move(*kept);
    else log::warning(kept.error().message);
  }
  source::Catalogue::Sets sets;
  std::set<std::string> seen;
  for (const source::ListedRaster& raster : list.rasters) {
    if (!seen.insert(raster.path).second) continue;
    const std::int64_t place = s.next_place++;
    if (raster.ring.size() >= 4 && raster.spacing.value > 0.0) {
      sets.push_back(s.data_set(raster.path, place, raster.ring, raster.spacing));
      continue;
    }
    const std::string revision = s.kept ? revision_of(layer, raster.path) : "";
    const auto kept = revision.empty() ? std::nullopt : s.kept->find(raster.path, revision);
    if (kept && kept->ring.size() >= 4) sets.push_back(s.data_set(raster.path, place, kept->ring, kept->spacing));
    else s.unexamined.emplace_back(raster.path, place);
  }
  const auto open = std::make_shared<source::OpenDataSets>(
      [how = s.setting.open, layer](const std::string& path) { return how(spec_of_raster(layer, path)); });
  const auto order = layer.source.catalogue.order == "listed" ? source::CatalogueOrder::listed : source::CatalogueOrder::finest;
  s.catalogue = std::make_shared<const source::Catalogue>(std::move(sets), order, open);
  const std::size_t unexamined = s.unexamined.size();
  std::unique_ptr<LayerCatalogue> made(new LayerCatalogue(std::move(state)));
  made->unexamined_ = unexamined;
  return made;
}

std::shared_ptr<const source::Catalogue> LayerCatalogue::current() const {
  std::lock_guard lock(state_->mutex);
  return state_->catalogue;
}

void LayerCatalogue::begin() {
  {
    std::lock_guard lock(state_->mutex);
    if (std::exchange(state_->begun, true)) return;
    state_->setting.publish(state_->catalogue);
  }
  if (unexamined_ > 0) state_->setting.look_into_more();
}

void LayerCatalogue::examine_some() {
  State& s = *state_;
  const auto until = std::chrono::steady_clock::now() + kExamination;
  source::Catalogue::Sets found;
  std::vector<source::FootprintStore::Entry> to_keep;
  std::size_t examined = 0;
  bool more = true;
  while (more && std::chrono::steady_clock::now() < until) {
    std::pair<std::string, std::int64_t> next;
    {
      std::lock_guard lock(s.mutex);
      more = !s.unexamined.empty();
      if (!more) break;
      next = std::move(s.unexamined.front());
      s.unexamined.pop_front();
    }
    ++examined;
    const auto& [path, place] = next;
    const std::string revision = revision_of(s.setting.layer, path);
    auto footprint = s.look_into(path);
    if (!footprint) {
      std::lock_guard lock(s.mutex);
      s.add_problem(footprint.error().message);
      continue;
    }
    found.push_back(s.data_set(path, place, footprint->ring, footprint->spacing));
    if (!revision.empty()) to_keep.push_back({path, revision, std::move(*footprint)});
  }
  s.change(std::move(found), {});
  if (s.kept) s.kept->keep(to_keep);
  unexamined_ -= examined;
  if (more) s.setting.look_into_more();
}

void LayerCatalogue::insert(const std::vector<std::string>& paths) {
  if (paths.empty()) return;
  {
    std::lock_guard lock(state_->mutex);
    for (const std::string& path : paths) state_->unexamined.emplace_back(whole_path(path), state_->next_place++);
  }
  unexamined_ += paths.size();
  state_->setting.look_into_more();
}

void LayerCatalogue::remove(const std::vector<std::string>& rasters) {
  std::vector<std::string> paths;
  std::ranges::transform(rasters, std::back_inserter(paths), whole_path);
  {
    std::lock_guard lock(state_->mutex);
    unexamined_ -= std::erase_if(state_->unexamined, [&](const auto& waiting) { return std::ranges::find(paths, waiting.first) != paths.end(); });
  }
  state_->change({}, paths);
}

LayerCatalogue::Problems LayerCatalogue::problems() const {
  std::lock_guard lock(state_->mutex);
  return state_->problems;
}

}  // namespace tellurion::globe
