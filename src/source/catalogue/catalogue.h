// Thousands of rasters as one layer: where each lies is known, they are opened when something that shows them is built.
// Thread-safe: a catalogue is immutable; a change makes another one, which shares what is open.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "base/quantity.h"
#include "base/result.h"
#include "geo/tile_key.h"
#include "source/catalogue/footprint.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// A raster of a catalogue.
struct DataSet {
  std::uint32_t id = 0;        ///< its number in the block cache's keys; never given to another
  std::string path;            ///< or URL
  std::int64_t place = 0;      ///< in the list: later ones lie over earlier ones
  Footprint footprint;
};

/// Which of two data sets lies over the other.
enum class CatalogueOrder {
  finest,  ///< the finer one; of equally fine ones the later
  listed,  ///< the later one
};

/// The open rasters of a catalogue and of all that were made from it. Holds the last ones used, kMostOpen at most; readers keep theirs
/// longer. What cannot be opened is not tried again, unless it was unavailable. Thread-safe.
class OpenDataSets {
 public:
  using Open = std::function<Result<std::unique_ptr<RasterSource>>(const std::string& path)>;
  explicit OpenDataSets(Open open);
  ~OpenDataSets();

  static constexpr std::size_t kMostOpen = 256;

  /// Errors: those of opening, naming the file. A raster that two threads want is opened twice at worst.
  Result<std::shared_ptr<const RasterSource>> open(const DataSet& set);

  struct Failures {
    std::int64_t count = 0;     ///< data sets that cannot be opened
    std::string last_error;
  };
  Failures failures() const;
  /// Numbers of those that were ever opened.
  std::vector<std::uint32_t> opened_ids() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

class Catalogue final : public Coverage {
 public:
  using Sets = std::vector<std::shared_ptr<const DataSet>>;

  Catalogue(Sets sets, CatalogueOrder order, std::shared_ptr<OpenDataSets> open);

  /// All data sets, the lowest first.
  const Sets& sets() const { return sets_; }
  CatalogueOrder order() const { return order_; }

  bool touches(const geo::TileKey& tile) const override;
  Metres spacing_under(const geo::TileKey& tile) const override;

  /// Data sets that touch `region` and are at least `least_extent` across, as indices of sets(), the uppermost first. `found` is
  /// emptied first.
  void find(const FaceRegion& region, Radians least_extent, std::vector<std::uint32_t>& found) const;

  Result<std::shared_ptr<const RasterSource>> open(std::uint32_t index) const { return open_->open(*sets_[index]); }
  const std::shared_ptr<OpenDataSets>& open_sets() const { return open_; }

  /// This and `more`, without those of the numbers `gone` (ascending).
  std::shared_ptr<const Catalogue> changed(Sets more, std::span<const std::uint32_t> gone) const;

 private:
  /// Of a tree of boxes over the unit sphere, children after their parent; a leaf holds a range of `leaves_`.
  struct Node {
    glm::vec3 lower{0.0f};
    glm::vec3 upper{0.0f};
    float finest = 0.0f;           ///< spacing, metres, rounded down
    float widest = 0.0f;           ///< extent, radians, rounded up
    std::uint32_t first = 0;       ///< of a leaf: in leaves_; else the second child (the first follows its parent)
    std::uint32_t count = 0;       ///< 0: not a leaf
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t end);
  template <class Enter, class Visit>
  void walk(const FaceRegion& region, const Enter& enter, const Visit& visit) const;

  Sets sets_;
  CatalogueOrder order_;
  std::shared_ptr<OpenDataSets> open_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> leaves_;  ///< indices of sets_
};

/// Data sets that only one of the two holds.
Catalogue::Sets difference(const Catalogue& before, const Catalogue& now);

}  // namespace tellurion::source
