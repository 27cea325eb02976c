#include "prepare/gdal/gmt_shoreline.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

using namespace tellurion;
using namespace tellurion::prepare;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kStep = 90.0 / 65535;  ///< degrees
constexpr int kBinColumns = 4;          ///< bins of 90 degrees

geo::LatLon at(double latitude, double longitude) { return {Radians(latitude * kDegree), Radians(longitude * kDegree)}; }

/// What a file holds.
struct Arrays {
  std::vector<double> minutes{5400}, counts = std::vector<double>(8, 0.0), segments, longitudes, latitudes;

  /// Degrees east of Greenwich and north within `bin`; bins in rising order.
  void add(int bin, int level, const std::vector<std::pair<double, double>>& line) {
    ++counts[static_cast<std::size_t>(bin)];
    segments.push_back(static_cast<double>(line.size() << 9 | static_cast<std::size_t>(level) << 6));
    const double west = 90.0 * (bin % kBinColumns), south = bin < kBinColumns ? 0.0 : -90.0;
    const auto steps = [](double degrees) { return static_cast<double>(static_cast<std::int16_t>(std::lround(degrees / kStep))); };
    for (const auto& [longitude, latitude] : line) {
      longitudes.push_back(steps(longitude - west));
      latitudes.push_back(steps(latitude - south));
    }
  }
};

/// An island with a lake, one on the 180th meridian, one where four bins meet, and a continent about the south pole with another line within.
Arrays some_land() {
  Arrays a;
  a.add(0, 1, {{10, 10}, {40, 10}, {40, 40}, {10, 40}, {10, 10}});
  a.add(0, 2, {{20, 20}, {30, 20}, {30, 30}, {20, 30}, {20, 20}});
  a.add(0, 1, {{85, 0}, {85, 10}, {90, 10}});  // runs the wrong way round
  a.add(1, 1, {{180, 50}, {170, 50}, {170, 40}, {180, 40}});
  a.add(1, 1, {{90, 10}, {95, 10}, {95, 0}});
  a.add(2, 1, {{180, 40}, {190, 40}, {190, 50}, {180, 50}});
  a.add(4, 1, {{90, -60}, {0, -60}});
  a.add(4, 6, {{90, -70}, {0, -70}});
  a.add(4, 1, {{90, -10}, {85, -10}, {85, 0}});
  a.add(5, 1, {{180, -60}, {135, -80}, {90, -60}});
  a.add(5, 1, {{95, 0}, {95, -10}, {90, -10}});
  a.add(6, 1, {{270, -60}, {180, -60}});
  a.add(7, 1, {{360, -60}, {270, -60}});
  return a;
}

/// A data set in memory.
class Made {
 public:
  explicit Made(const Arrays& arrays) {
    add("Bin_size_in_minutes", arrays.minutes);
    add("N_segments_in_a_bin", arrays.counts);
    add("Embedded_npts_levels_exit_entry_for_a_segment", arrays.segments);
    add("Relative_longitude_from_SW_corner_of_bin", arrays.longitudes);
    add("Relative_latitude_from_SW_corner_of_bin", arrays.latitudes);
  }

  Result<Land> read() { return read_gmt_shoreline(*dataset_, "coast.nc"); }

  std::shared_ptr<GDALMDArray> make(const char* name, const std::vector<std::size_t>& sizes, GDALDataType type) {
    std::vector<std::shared_ptr<GDALDimension>> dimensions;
    for (const std::size_t size : sizes) dimensions.push_back(group_->CreateDimension(std::string(name) + std::to_string(dimensions.size()), "", "", size));
    return group_->CreateMDArray(name, dimensions, GDALExtendedDataType::Create(type));
  }

 private:
  void add(const char* name, const std::vector<double>& values) {
    if (values.empty()) return;
    const GUInt64 first = 0;
    const std::size_t count = values.size();
    REQUIRE(make(name, {count}, GDT_Float64)->Write(&first, &count, nullptr, nullptr, GDALExtendedDataType::Create(GDT_Float64), values.data()));
  }

  GDALDatasetUniquePtr dataset_ = [] {
    GDALAllRegister();
    return GDALDatasetUniquePtr(GetGDALDriverManager()->GetDriverByName("MEM")->CreateMultiDimensional("shoreline", nullptr, nullptr));
  }();
  std::shared_ptr<GDALGroup> group_ = dataset_->GetRootGroup();
};

void is_refused(Made made, ErrorCode code = ErrorCode::corrupt) {
  const Result<Land> land = made.read();
  REQUIRE_FALSE(land);
  CHECK(land.error().code == code);
  CHECK(land.error().message.starts_with("coast.nc: "));
}

}  // namespace

TEST_CASE("read_gmt_shoreline: land is as the lines say, over borders of bins, the 180th meridian and the pole") {
  const Result<Land> land = Made(some_land()).read();
  REQUIRE(land);
  CHECK(land->size() == 4);
  const Shore shore(geo::kWgs84, {*land});
  for (const auto& place : {std::pair{15, 15}, {25, 25}, {45, 175}, {45, -175}, {45, 180}, {5, 89}, {-5, 91}, {-5, 86}, {9, 94}, {-65, 0}, {-65, -180}, {-65, 180}, {-89, 45}, {-65, -90}, {-81, 135}}) {
    CAPTURE(place.first);
    CAPTURE(place.second);
    CHECK(shore.is_land(at(place.first, place.second)));
  }
  for (const auto& place : {std::pair{9, 15}, {25, 45}, {45, 165}, {45, -165}, {45, 0}, {5, 84}, {-11, 91}, {5, 96}, {-59, 0}, {-59, 180}, {-70, 135}, {89, 0}, {0, -90}}) {
    CAPTURE(place.first);
    CAPTURE(place.second);
    CHECK_FALSE(shore.is_land(at(place.first, place.second)));
  }
}

TEST_CASE("read_gmt_shoreline: neither borders of bins nor lakes nor what closes the ring about the pole are coast") {
  const Result<Land> land = Made(some_land()).read();
  REQUIRE(land);
  const Shore shore(geo::kWgs84, {*land});
  const auto distance = [&](double latitude, double longitude) { return shore.distance(geo::surface_point(geo::kWgs84, geo::normal_at(at(latitude, longitude))), 1e7); };
  CHECK(distance(45, 180) > 500e3);    // 555 km to the north and south
  CHECK(distance(0, 90) > 500e3);
  CHECK(distance(25, 25) > 1400e3);    // the lake is 500 km off
  CHECK(distance(-80, 180) > 500e3);   // 850 km to the point at 135 degrees
  CHECK(distance(-70, 0) > 900e3);     // the other line is there
  CHECK(distance(-60, 180) < kStep * 111e3);
}

TEST_CASE("read_gmt_shoreline: damaged files are refused") {
  Arrays a = some_land();
  SUBCASE("a segment too many") { ++a.counts[7]; }
  SUBCASE("a segment too few") { --a.counts[0]; }
  SUBCASE("a negative number of segments") { a.counts[3] = -1, a.counts[2] += 1; }
  SUBCASE("more points than there are") { a.segments[3] = (1 << 30) + 64; }
  SUBCASE("all bits of a segment") { a.segments[3] = -1; }
  SUBCASE("no points") { a.segments[0] = 64; }
  SUBCASE("points left over") { a.longitudes.push_back(0), a.latitudes.push_back(0); }
  SUBCASE("longitudes without latitudes") { a.latitudes.pop_back(); }
  SUBCASE("a line that does not close") { a.latitudes[4] += 1; }
  SUBCASE("a line that does not go on in the next bin") { a.latitudes.back() += 1; }
  SUBCASE("a segment of another bin") { --a.counts[4], ++a.counts[5]; }
  SUBCASE("no number") { a.longitudes[0] = std::numeric_limits<double>::quiet_NaN(); }
  SUBCASE("bins without a size") { a.minutes = {0}; }
  SUBCASE("bins of another size") { a.minutes = {600}; }
  SUBCASE("bins of a negative size") { a.minutes = {-5400}; }
  SUBCASE("bins that do not fill the Earth") { a.minutes = {5401}; }
  SUBCASE("bins larger than the Earth") { a.minutes = {21600}; }
  is_refused(Made(a));
}

TEST_CASE("read_gmt_shoreline: other files are refused, and arrays that are no list or a list too long to be read") {
  Arrays a = some_land();
  a.latitudes.clear();
  is_refused(Made(a));
  for (const std::vector<std::size_t>& sizes : {std::vector<std::size_t>{}, {5, 5}, {40'000'000}}) {
    Made made(a);
    made.make("Relative_latitude_from_SW_corner_of_bin", sizes, GDT_Byte);
    is_refused(std::move(made));
  }
  a.segments.clear();
  is_refused(Made(a), ErrorCode::unsupported);
}
