// What the surface is made of at a moment: of layers with times the source of the step that holds then.
// Thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "globe/globe.h"
#include "source/temporal/time_steps.h"
#include "surface/elevation_model.h"

namespace tellurion::globe {

class SurfaceSteps {
 public:
  using OpenSource = std::function<Result<std::unique_ptr<source::RasterSource>>(const LayerSpec&)>;

  /// Layers without times are those of `layers` that have a raster. Sources of steps are opened by `open` when first asked for;
  /// at most kHeldSources of a layer stay open.
  SurfaceSteps(const geo::Ellipsoid& ellipsoid, const std::vector<LayerInfo>& layers, OpenSource open);

  /// The surface at `time`; without one the last step of each layer. A layer whose source cannot be opened is left out.
  /// The same object for the same steps, as long as it is among the last few that were asked for.
  std::shared_ptr<const surface::SurfaceDescription> at(const std::optional<UtcTime>& time);
  /// The same, but opens nothing: null if it is not among the last few.
  std::shared_ptr<const surface::SurfaceDescription> held_at(const std::optional<UtcTime>& time);

  // From now on. What is held is described anew, without opening anything; a layer that has been removed stays so.

  /// Another layer, over the others of its group: the number after the last. Shows nothing before it has a source, a catalogue or times.
  std::size_t add(const LayerSpec& spec);
  /// Lets go of what is open of it. The others keep their numbers.
  void remove(std::size_t layer);
  /// A layer shows another catalogue.
  void set_catalogue(std::size_t layer, std::shared_ptr<const source::Catalogue> catalogue);
  /// A layer without times has this source. What was read of it before no longer counts, even of the same source.
  void set_source(std::size_t layer, std::shared_ptr<const source::RasterSource> source);
  /// The steps of a layer with times are opened and read anew.
  void reopen_steps(std::size_t layer);
  void set_settings(std::size_t layer, const LayerSettings& settings);
  /// A layer lies over (`up`), or under, the next one of its group. False if there is none.
  bool move(std::size_t layer, bool up);

  LayerSettings settings(std::size_t layer) const;
  /// All layers that have not been removed, the lowest first.
  std::vector<std::size_t> order() const;

  /// A layer's source at `time`; null: it has none.
  std::shared_ptr<const source::RasterSource> raster_at(std::size_t layer, const std::optional<UtcTime>& time);
  /// How the step of a layer is written; empty if it has no times.
  std::string text_of(std::size_t layer, const std::optional<UtcTime>& time) const;
  /// All of a layer's numbers in the block cache.
  std::vector<std::uint32_t> source_ids(std::size_t layer) const;
  /// Steps that could not be opened, and why not the last of them.
  struct Failures {
    std::int64_t count = 0;
    std::string last_error;
  };
  Failures failures_of(std::size_t layer) const;

  static constexpr std::size_t kHeldSources = 8;
  static constexpr std::size_t kHeldSurfaces = 4;

 private:
  using Source = std::shared_ptr<const source::RasterSource>;
  struct TimedLayer {
    source::TimeSteps times;
    std::map<std::int64_t, std::uint32_t> ids;            ///< of steps that were opened
    std::list<std::pair<std::int64_t, Source>> open;      ///< the most recently used first; null: cannot be opened
    Failures failures;
  };
  struct OneLayer {
    explicit OneLayer(const LayerSpec& s);

    const LayerSpec spec;             ///< with the settings that it began with
    std::optional<TimedLayer> timed;  ///< its times never change; the rest is guarded as what follows
    // Guarded by mutex_:
    std::uint32_t id = 0;             ///< number in the block cache; steps have their own
    std::uint32_t content = 0;        ///< how often it has been read anew
    Source fixed;                     ///< null: it has times, or has not been opened
    std::shared_ptr<const source::Catalogue> catalogue;
    LayerSettings settings;
    bool removed = false;
  };
  using Steps = std::vector<std::int64_t>;  ///< of every layer; 0 of those without times

  OneLayer& layer_at(std::size_t layer);
  std::size_t append(const LayerSpec& spec);
  void find_steps(const std::optional<UtcTime>& time, Steps& steps) const;
  /// Opens it if it is not open, without the lock.
  Source source_of(OneLayer& layer, std::int64_t step);
  std::shared_ptr<const surface::SurfaceDescription> held(const Steps& steps);
  std::shared_ptr<const surface::SurfaceDescription> describe(const Steps& steps, const std::vector<Source>& sources);
  void describe_anew();

  geo::Ellipsoid ellipsoid_;
  OpenSource open_;

  mutable std::mutex mutex_;        ///< guards what follows and what the timed layers have open; never held while a source is opened
  std::deque<OneLayer> layers_;     ///< stay where they are
  bool has_times_ = false;          ///< some layer has
  std::vector<std::size_t> order_;  ///< in which layers are drawn
  std::uint32_t next_id_ = 0;
  std::uint64_t reopened_ = 0;      ///< calls of reopen_steps: what was opened before the last may be old
  std::uint64_t last_revision_ = 0;
  Steps asked_steps_;               ///< of the last question: frames ask, and must not allocate
  std::list<std::pair<Steps, std::shared_ptr<const surface::SurfaceDescription>>> surfaces_;  ///< the most recently used first
};

}  // namespace tellurion::globe
