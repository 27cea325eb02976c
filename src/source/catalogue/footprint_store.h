// Footprints found by opening rasters, kept in the cache folder for the next time.
// Thread-safe; several programs may share the file.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "geo/geodetic.h"

namespace tellurion::source {

struct KeptFootprint {
  std::vector<geo::LatLon> ring;
  Metres spacing{0.0};
};

class FootprintStore {
 public:
  /// Opens or makes the file; one that is damaged is made anew. Errors: unavailable, naming the file.
  static Result<std::unique_ptr<FootprintStore>> open(const std::filesystem::path& file);
  ~FootprintStore();

  /// Nothing if it is not kept, or the raster has another revision. `revision` names the content (path, size, time of change) and how it was opened.
  std::optional<KeptFootprint> find(const std::string& path, const std::string& revision) const;
  /// Kept together, in one transaction; failures to write are no errors: the footprint is found again.
  struct Entry {
    std::string path;
    std::string revision;
    KeptFootprint footprint;
  };
  void keep(const std::vector<Entry>& entries);

 private:
  struct State;
  explicit FootprintStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::source
