// The front door: opens a world and keeps all that its views share: sources, decoded data, workers, error tables.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "fetch/fetcher.h"
#include "geo/ellipsoid.h"
#include "globe/frame_stats.h"
#include "globe/world.h"
#include "view/camera.h"

namespace tellurion::cache { class BlockCache; }
namespace tellurion::source {
class Catalogue;
class RasterSource;
}
namespace tellurion::surface {
class GlobalHeights;
struct SurfaceDescription;
class SurfaceFacts;
}

namespace tellurion::globe {

class SurfaceWorker;

struct GlobeOptions {
  std::size_t memory_cache_bytes = std::size_t{512} << 20;  ///< decoded data, GDAL's block cache included
  int workers = -1;                                         ///< threads; 0: none, all on the calling thread; -1: by the machine
  std::filesystem::path cache_folder;                       ///< for kept tables; empty: nothing is kept
  std::size_t disk_cache_bytes = std::size_t{4} << 30;      ///< of files from servers, in the cache folder
  bool offline = false;                                     ///< no network: what the disk cache has counts, however old
  bool scan_heights = true;                                 ///< make error tables in the background
  std::optional<UtcTime> time;                              ///< at which layers with times are opened first
};

/// Where caches are kept unless told otherwise: $XDG_CACHE_HOME/tellurion or ~/.cache/tellurion; empty if neither is set.
std::filesystem::path default_cache_folder();

class Globe;

enum class HeightLookup { nearest, bilinear };

/// Heights out of the sources' own samples, as the globe's layers were when it was made. Belongs to one thread; the globe outlives it.
class HeightSampler {
 public:
  struct Answer {
    EllipsoidalHeight height;
    double level = 0;       ///< log2(half circumference / sample spacing) of the data that answered; -1: no data here, height 0
  };
  struct AnswerNow : Answer {
    bool is_final = false;  ///< that of height_at; else a worker fetches or reads what lacks
  };
  /// `wanted_spacing` in metres: the resolution to answer from; 0: the deepest. Reads files, waits for servers.
  Result<Answer> height_at(const geo::LatLon& place, HeightLookup lookup = HeightLookup::bilinear, Metres wanted_spacing = Metres(0));
  /// The same (bilinear) at once, from the finest samples in memory: at least a grid of the whole body, about 78 km on Earth, as soon as a
  /// worker has made it. Ask again, there or nearby, for better ones. Reads and waits for nothing, but that the first call opens the
  /// layers' files and rasters of a catalogue are opened when they are met. Without threads Globe::run_one does the work.
  AnswerNow height_now(const geo::LatLon& place, Metres wanted_spacing = Metres(0));
  /// Unit normal of the ground. Reads and waits as height_at.
  Result<geo::Vector<geo::Ecef>> normal_at(const geo::LatLon& place, Metres wanted_spacing = Metres(0));

  HeightSampler(HeightSampler&&) noexcept;
  ~HeightSampler();

 private:
  friend class Globe;
  struct State;
  explicit HeightSampler(std::unique_ptr<State> state);
  using Submit = std::function<bool(std::function<void(SurfaceWorker&)>)>;
  static Result<HeightSampler> open(const Globe& globe, cache::BlockCache& blocks, Submit submit);
  std::unique_ptr<State> state_;
};

/// A layer of an open world, as it was when the world was opened; of one that came later only the spec.
struct LayerInfo {
  LayerSpec spec;
  std::shared_ptr<const source::RasterSource> raster;   ///< null: disabled, of a group that is not drawn, or not opened
  std::string error;                                    ///< why it was not opened
  std::shared_ptr<const source::Catalogue> catalogue{}; ///< of type "catalogue"
};

/// What became of data that were put on a globe.
struct AddedData {
  std::string data;           ///< as they were named
  Result<std::size_t> layer;  ///< its number, or why there is none
};

/// Which layers stand in which world file.
struct KeptLayers {
  std::filesystem::path file;    ///< empty: in none
  std::set<std::size_t> layers;  ///< also such as have been removed since
};

/// A world that is open. Its functions are thread-safe unless they say otherwise.
class Globe {
 public:
  /// Opens every enabled layer. A layer that cannot be opened is left out: see source_stats() and hints().
  /// Errors: what makes the whole world useless.
  static Result<std::unique_ptr<Globe>> open(World world, const GlobeOptions& options);
  ~Globe();

  const World& world() const;  ///< as it was opened
  const geo::Ellipsoid& ellipsoid() const;

  /// A good first look: the finest layer's data if they are regional, else the whole body. Reads heights.
  view::Pose home() const;
  /// The same of one layer's data.
  view::Pose home(std::size_t layer) const;

  // Layers are known by number, from 0 as in the world's list. Those that are added get the numbers after that; one that has been removed
  // leaves its number unused, switched off and out of layer_order().

  /// With those that have been removed.
  std::size_t layer_count() const;
  /// Stays where it is, as it is, as long as the globe.
  const LayerInfo& layer(std::size_t layer) const;
  /// What a layer shows now; of one with times what it showed at first. Null: nothing, or a catalogue. Opens nothing.
  std::shared_ptr<const source::RasterSource> shown_raster(std::size_t layer) const;
  /// A layer's raster at `time`, which may be opened for that; null as LayerInfo's.
  std::shared_ptr<const source::RasterSource> raster_at(std::size_t layer, const std::optional<UtcTime>& time) const;
  /// What of a layer with times is shown at `time`, as its path or URL has it; empty for others.
  std::string step_of(std::size_t layer, const std::optional<UtcTime>& time) const;

  /// Sentences that a user should see: layers left out, data without a vertical datum.
  std::vector<std::string> hints() const;
  /// Sentences on what was found wrong since, with the rasters of catalogues: the first few of each, and how many more there are.
  std::vector<std::string> problems() const;
  std::vector<SourceStats> source_stats() const;
  /// Whether some data could not be read and never will: what may still come does not count.
  bool data_missing() const;
  std::size_t memory_cache_bytes() const;
  std::size_t disk_cache_bytes() const;
  fetch::FetchStats fetch_stats() const;
  std::size_t memory_budget_bytes() const;

  /// What may be changed of a layer as it is now. Changes show at once, where tiles have been made anew with them.
  LayerSettings layer_settings(std::size_t layer) const;
  /// One that was off when the world was opened is opened by a worker; until then it shows nothing; if it fails, source_stats tells why.
  /// Errors: invalid_argument (no such layer, a value out of its range, adding what are no heights).
  Result<void> set_layer(std::size_t layer, const LayerSettings& settings);
  /// The layer lies over (`up`), or under, the next one of its group. False if there is none.
  bool move_layer(std::size_t layer, bool up);
  /// All layers, the lowest first.
  std::vector<std::size_t> layer_order() const;

  /// Puts a layer over the others of its group, for as long as the globe is open, and gives its number. Returns at once: a worker opens it;
  /// until then it shows nothing; if it fails, source_stats and hints tell why. Only the tiles that it touches are made anew.
  /// Paths are absolute. Errors: invalid_argument (settings out of their range).
  Result<std::size_t> add_layer(const LayerSpec& spec);
  /// Reads a layer's data anew: its file, server or program may have others by now. Returns at once; what was shown is shown until tiles have
  /// been made of them, and for good if it cannot be opened again: source_stats tells why. Replies of servers count as long as these said.
  /// Of a catalogue insert() does that, for each raster. Errors: invalid_argument (no such layer, or a catalogue).
  Result<void> refresh_layer(std::size_t layer);
  /// Takes one away. Errors: invalid_argument (there is none of this number any more).
  Result<void> remove_layer(std::size_t layer);
  /// Puts data on top as `tellurion world add` would: each a layer of what it looks like, a folder a catalogue. Returns at once; a worker
  /// opens them one after the other, and calls `done` with what became of each. What cannot be opened becomes no layer.
  void add_data(std::vector<std::string> data, std::function<void(const std::vector<AddedData>&)> done);

  /// Where the layers are kept: at first in the file that the world was read from, all of them.
  KeptLayers kept_layers() const;
  /// Calls `change` with that, not two at a time, and takes over what it makes of it if it succeeds. For save_layers.
  Result<void> change_kept_layers(const std::function<Result<void>(KeptLayers&)>& change);

  /// Puts rasters (paths or URLs) into a layer of type "catalogue", in the place of those of the same path; or takes some out. Both return at
  /// once; files are looked into by workers, and only the tiles that they touch are made anew. Kept while the globe is open.
  /// Errors: invalid_argument (no such layer, or none of that type); unavailable (a worker has still to open it).
  Result<void> insert(std::size_t layer, const std::vector<std::string>& rasters);
  Result<void> remove(std::size_t layer, const std::vector<std::string>& rasters);
  /// A catalogue's rasters as they are known now; null for other layers.
  std::shared_ptr<const source::Catalogue> catalogue_of(std::size_t layer) const;
  /// How many rasters of it have not been looked into.
  std::size_t rasters_to_look_into(std::size_t layer) const;
  /// Whether all rasters of catalogues have been looked into, and layers that were switched on or added are open.
  bool catalogues_ready() const;
  /// Waits for that (without threads: looks into them here). False if `deadline` came first.
  bool wait_for_catalogues(std::chrono::steady_clock::time_point deadline);

  /// Error tables of the height sources: made in the background, kept in the cache folder.
  bool tables_ready() const;
  /// Begins to make them; the first view does, once it has its coarsest tiles.
  void begin_tables();
  /// Waits for them (without threads: makes them here). False if `deadline` came first.
  bool wait_for_tables(std::chrono::steady_clock::time_point deadline);

  Result<HeightSampler> height_sampler() const;
  /// Heights of the whole body, always in memory once a worker has made them (the first view sees to that); null before. Reads nothing.
  std::shared_ptr<const surface::GlobalHeights> resident_heights() const;

  // For the views of this globe.
  std::shared_ptr<const surface::SurfaceDescription> surface() const;  ///< at GlobeOptions::time; its heights hold at all times, until a catalogue changes
  std::shared_ptr<const surface::SurfaceFacts> facts() const;   ///< of it; replaced when the tables are ready
  /// The surface at another time (opens files where a step comes up): the same object while no layer's step changes.
  std::shared_ptr<const surface::SurfaceDescription> surface_at(const std::optional<UtcTime>& time) const;
  /// The same if it was asked for lately; else null. Opens nothing.
  std::shared_ptr<const surface::SurfaceDescription> held_surface_at(const std::optional<UtcTime>& time) const;
  std::shared_ptr<const surface::SurfaceFacts> facts_of(const std::shared_ptr<const surface::SurfaceDescription>& surface) const;
  /// Runs `work` on a worker with its own readers. False if too much waits; never waits itself.
  bool try_submit(std::function<void(SurfaceWorker&)> work);
  /// The same with the surface at `time`, which the worker opens.
  bool try_submit_at(const std::optional<UtcTime>& time,
                     std::function<void(SurfaceWorker&, const std::shared_ptr<const surface::SurfaceDescription>&)> work);
  /// Without threads: runs a waiting job. False if there is none, or there are threads.
  bool run_one();
  int worker_count() const;

 private:
  struct State;
  explicit Globe(std::unique_ptr<State> state);
  view::Pose home_of(const std::vector<std::size_t>& layers) const;
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::globe
