// A layer of type "catalogue" while its world is open: the list is read at once, what it does not tell of its rasters is found by
// workers, and rasters come and go. Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "globe/world.h"
#include "source/catalogue/catalogue.h"

namespace tellurion::globe {

class LayerCatalogue {
 public:
  struct Setting {
    LayerSpec layer;
    geo::Ellipsoid world;
    std::filesystem::path cache_folder;   ///< for footprints; empty: they are not kept
    std::function<Result<std::unique_ptr<source::RasterSource>>(const LayerSpec&)> open;  ///< of a layer of one raster
    std::function<std::uint32_t()> next_id;   ///< thread-safe
    std::function<void()> look_into_more;     ///< has examine_some called by a worker
    std::function<void(std::shared_ptr<const source::Catalogue>)> publish;
  };

  /// Reads the layer's list. Errors: those of list_rasters. Nothing is published before `begin`.
  static Result<std::unique_ptr<LayerCatalogue>> open(Setting setting);
  ~LayerCatalogue();

  /// What is known now.
  std::shared_ptr<const source::Catalogue> current() const;
  /// What is known is published, and from now on what is found out. Again: nothing.
  void begin();
  /// Worker side: looks into some rasters whose footprint is not known, publishes what it found, and asks for another call if there are more.
  void examine_some();
  /// How many rasters have not been looked into.
  std::size_t unexamined() const { return unexamined_; }

  /// Puts rasters in, over the others of their fineness; in the place of those of the same path. They show once they have been looked into.
  void insert(const std::vector<std::string>& paths);
  /// Takes rasters out. Those that are not in it are ignored.
  void remove(const std::vector<std::string>& paths);

  /// Sentences on what was left out, and how many rasters that concerns.
  struct Problems {
    std::int64_t count = 0;
    std::vector<std::string> sentences;   ///< the first few
  };
  Problems problems() const;

 private:
  struct State;
  explicit LayerCatalogue(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
  std::atomic<std::size_t> unexamined_{0};
};

}  // namespace tellurion::globe
