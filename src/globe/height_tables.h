// The error tables of a surface's height layers: loaded if they were kept or lie beside a raster, else made in the background and kept.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "cache/block_cache.h"
#include "globe/worker_pool.h"
#include "surface/elevation_model.h"
#include "surface/surface_facts_made.h"

namespace tellurion::globe {

class HeightTables {
 public:
  using Publish = std::function<void(std::shared_ptr<const surface::KnownErrors>)>;

  /// `publish` gets what is known when tables have been loaded or made, on any thread.
  /// `blocks` and `pool` outlive the jobs.
  HeightTables(std::shared_ptr<const surface::SurfaceDescription> surface, cache::BlockCache& blocks,
               std::filesystem::path cache_folder, WorkerPool& pool, Publish publish);
  ~HeightTables();

  /// What the surface's heights are, as far as the tables depend on them.
  const std::string& revision() const;
  /// Loads the tables that were kept or prepared; reads files. With `scan` false the estimates stay otherwise.
  void load(bool scan);
  /// Begins to make the table, once, if it was not kept; does not wait. Nothing before it was looked for.
  void begin_scan();
  /// Whether the facts are final.
  bool ready() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tellurion::globe
