#include "prepare/gdal/gmt_shoreline.h"

#include <cstdint>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "source/gdal/gdal_runtime.h"

namespace tellurion::prepare {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::int64_t kBinSteps = 65535;          ///< of a bin's side, in which its points are given
constexpr std::uint64_t kMostValues = 33'000'000;  ///< of an array; the finest file has 11 million points
constexpr std::int64_t kHalfTurnMinutes = 10'800;
constexpr std::uint32_t kLandLevel = 1;

using Values = std::vector<std::int32_t>;

/// Bins go from Greenwich eastwards, in rows from north to south; segments and points follow each other as their bins do.
struct Bins {
  Values minutes;                ///< of a bin's side; one value
  Values segment_counts;         ///< of bins
  Values segments;               ///< points << 9 | level << 6 | sides of the bin
  Values longitudes, latitudes;  ///< of points: steps from the bin's south-west corner, as 16 bits without sign
};

bool read_array(const GDALGroup& group, const char* name, Values& values) {
  const auto array = group.OpenMDArray(name);
  if (!array || array->GetDimensionCount() != 1) return false;
  const GUInt64 size = array->GetDimensions()[0]->GetSize();
  if (size == 0 || size > kMostValues) return false;
  values.resize(size);
  const GUInt64 first = 0;
  const std::size_t count = values.size();
  return array->Read(&first, &count, nullptr, nullptr, GDALExtendedDataType::Create(GDT_Int32), values.data());
}

/// Steps to the east of the 180th meridian and to the north of the south pole.
struct Point {
  std::int64_t x = 0, y = 0;
};

/// Joins what the bins cut: a segment ends where the next one begins.
class Joiner {
 public:
  explicit Joiner(const Bins& bins) : bins_(bins), rows_(kHalfTurnMinutes / bins.minutes[0]), columns_(2 * rows_) {}

  /// False if numbers contradict each other.
  bool find_segments() {
    if (bins_.segment_counts.size() != static_cast<std::size_t>(rows_ * columns_) || bins_.longitudes.size() != bins_.latitudes.size()) return false;
    std::size_t index = 0, first = 0;
    for (std::size_t bin = 0; bin < bins_.segment_counts.size(); ++bin) {
      for (std::int32_t i = 0; i < bins_.segment_counts[bin]; ++i, ++index) {
        if (index == bins_.segments.size()) return false;
        const auto about = static_cast<std::uint32_t>(bins_.segments[index]);
        const std::size_t count = about >> 9;
        if (count == 0 || count > bins_.longitudes.size() - first) return false;
        const Segment segment{static_cast<std::int64_t>(bin), first, count};
        if ((about >> 6 & 7) == kLandLevel) open_.emplace(key(point(segment, 0)), segment);
        first += count;
      }
    }
    return index == bins_.segments.size() && first == bins_.longitudes.size();
  }

  /// Adds a ring of what begins first, on the 180th meridian if a line comes there. False if it does not close.
  bool join_ring(Land& land) {
    const Point begin = point(open_.begin()->second, 0);
    Point end = begin;
    Ring ring{place(begin)};
    for (auto next = open_.begin(); next != open_.end(); next = open_.find(key(end))) {
      const Segment segment = next->second;
      open_.erase(next);
      const std::int64_t turns = end.x - point(segment, 0).x;
      for (std::size_t i = 1; i < segment.count; ++i) {
        end = point(segment, i);
        end.x += turns;
        ring.push_back(place(end));
      }
    }
    if (end.y != begin.y || (end.x != begin.x && std::abs(end.x - begin.x) != turn())) return false;
    if (end.x == begin.x) {
      ring.pop_back();
    } else {  // land is to the left: this ring goes once around a pole
      const Radians pole(end.x < begin.x ? -kPi / 2.0 : kPi / 2.0);
      ring.push_back({pole, place(end).longitude});
      ring.push_back({pole, place(begin).longitude});
    }
    land.push_back(std::move(ring));
    return true;
  }

  bool done() const { return open_.empty(); }

 private:
  using Key = std::pair<std::int64_t, std::int64_t>;  ///< x within one turn, y

  struct Segment {
    std::int64_t bin;
    std::size_t first, count;  ///< points
  };

  std::int64_t turn() const { return columns_ * kBinSteps; }
  Key key(const Point& point) const { return {((point.x % turn()) + turn()) % turn(), point.y}; }

  Point point(const Segment& segment, std::size_t index) const {
    const std::int64_t column = (segment.bin % columns_ + rows_) % columns_, row = rows_ - 1 - segment.bin / columns_;
    const auto steps = [&](const Values& values) { return static_cast<std::uint16_t>(values[segment.first + index]); };
    return {column * kBinSteps + steps(bins_.longitudes), row * kBinSteps + steps(bins_.latitudes)};
  }

  geo::LatLon place(const Point& point) const {
    const auto angle = [&](std::int64_t steps) { return static_cast<double>(steps) / static_cast<double>(turn()) * 2.0 * kPi; };
    return {Radians(angle(point.y) - kPi / 2.0), Radians(angle(point.x) - kPi)};
  }

  const Bins& bins_;
  std::int64_t rows_, columns_;
  std::multimap<Key, Segment> open_;  ///< by where they begin
};

}  // namespace

Result<Land> read_gmt_shoreline(GDALDataset& dataset, const std::string& path) {
  const source::QuietErrors quiet;
  const auto damaged = [&](const std::string& what) {
    return Error{ErrorCode::corrupt, fmt::format("{}: is damaged ({}); get it anew (Debian: apt-get install --reinstall gmt-gshhg-low)", path, what)};
  };
  const auto group = dataset.GetRootGroup();
  constexpr const char* kSegments = "Embedded_npts_levels_exit_entry_for_a_segment";
  if (!group || !group->OpenMDArray(kSegments)) {
    return {ErrorCode::unsupported, fmt::format("{}: is a netCDF file without GSHHG's shorelines; a coast is a file of polygons of land, or binned_GSHHS_*.nc (Debian: gmt-gshhg-low)", path)};
  }
  Bins bins;
  for (const auto& [name, values] : {std::pair{"Bin_size_in_minutes", &bins.minutes},
                                     {"N_segments_in_a_bin", &bins.segment_counts},
                                     {kSegments, &bins.segments},
                                     {"Relative_longitude_from_SW_corner_of_bin", &bins.longitudes},
                                     {"Relative_latitude_from_SW_corner_of_bin", &bins.latitudes}}) {
    if (!read_array(*group, name, *values)) return damaged(fmt::format("{} cannot be read", name));
  }
  if (bins.minutes[0] <= 0 || kHalfTurnMinutes % bins.minutes[0] != 0) return damaged(fmt::format("bins of {} minutes", bins.minutes[0]));
  Joiner joiner(bins);
  if (!joiner.find_segments()) return damaged("numbers of segments and points contradict each other");
  Land land;
  while (!joiner.done()) {
    if (!joiner.join_ring(land)) return damaged("a shoreline does not close");
  }
  return land;
}

}  // namespace tellurion::prepare
