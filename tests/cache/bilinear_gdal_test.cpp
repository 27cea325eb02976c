// What a CachedRaster of a real raster answers, held against GDAL's own bilinear resampling (gdalwarp -r bilinear).
#include <cmath>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <gdal_utils.h>

#include "cache/cached_raster.h"
#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;

namespace {

/// Warps a part of the raster in its own CRS to a slightly finer grid, and compares every sample.
void compare(const std::string& path, glm::dvec2 first, glm::dvec2 last) {
  CAPTURE(path);
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str()));
  REQUIRE(dataset);
  std::array<double, 6> t{};
  REQUIRE(dataset->GetGeoTransform(t.data()) == CE_None);
  constexpr int kSide = 300;
  const auto text = [](double v) { return std::to_string(v); };
  const glm::dvec2 lower(t[0] + first.x * t[1], t[3] + last.y * t[5]);
  const glm::dvec2 upper(t[0] + last.x * t[1], t[3] + first.y * t[5]);
  const std::vector<std::string> words{"-of", "MEM", "-r", "bilinear", "-ot", "Float64", "-et", "0", "-ovr", "NONE", "-dstnodata", "-99999", "-te",
                                       text(lower.x), text(lower.y), text(upper.x), text(upper.y), "-ts", text(kSide), text(kSide)};
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  GDALWarpAppOptions* options = GDALWarpAppOptionsNew(arguments.data(), nullptr);
  GDALDatasetH input = GDALDataset::ToHandle(dataset.get());
  const GDALDatasetUniquePtr warped(GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &input, options, nullptr)));
  GDALWarpAppOptionsFree(options);
  REQUIRE(warped);
  std::vector<double> theirs(kSide * kSide);
  REQUIRE(warped->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, kSide, kSide, theirs.data(), kSide, kSide, GDT_Float64, 0, 0, nullptr) == CE_None);
  std::array<double, 6> w{};
  REQUIRE(warped->GetGeoTransform(w.data()) == CE_None);  // with the six digits that were written

  const auto source = std::move(source::open_gdal({.path = path}, geo::kWgs84)).value();
  cache::BlockCache blocks(64 << 20);
  cache::CachedRaster raster = std::move(cache::CachedRaster::open(*source, blocks, 1)).value();
  std::vector<glm::dvec2> pixels;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      pixels.push_back({(w[0] + (x + 0.5) * w[1] - t[0]) / t[1], (w[3] + (y + 0.5) * w[5] - t[3]) / t[5]});
    }
  }
  std::vector<cache::HeightSample> ours(pixels.size());
  REQUIRE(raster.sample_heights(0, pixels, ours));
  int compared = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (theirs[i] == -99999.0 || ours[i].coverage < 0.25) continue;  // GDAL wants the nearest sample itself to be valid
    CAPTURE(pixels[i].x);
    CAPTURE(pixels[i].y);
    REQUIRE(std::abs(ours[i].metres - theirs[i]) < 0.001);
    ++compared;
  }
  CHECK(compared > kSide * kSide / 2);
}

}  // namespace

TEST_CASE("sample_heights: agrees with gdalwarp -r bilinear to 1 mm, round voids too") {
  if (const auto path = test::shared_data("earth/elevation/etopo5.tif")) compare(*path, {3200.3, 700.2}, {3450.1, 950.9});
  if (const auto path = test::shared_data("earth/regional/mt_everest_90m.tif")) compare(*path, {500.3, 700.2}, {750.1, 950.9});
  if (const auto path = test::shared_data("earth/regional/mt_rainier_90m.tif")) compare(*path, {20.4, 20.6}, {270.1, 270.9});
  if (const auto path = test::shared_data("earth/regional/dsm.tif")) compare(*path, {20.25, 2.5}, {250.75, 240.25});
}

TEST_CASE("sample_heights: across the antimeridian and at the pole etopo5 is continuous") {
  const auto path = test::shared_data("earth/elevation/etopo5.tif");
  if (!path) return;
  const auto source = std::move(source::open_gdal({.path = *path}, geo::kWgs84)).value();
  cache::BlockCache blocks(64 << 20);
  cache::CachedRaster raster = std::move(cache::CachedRaster::open(*source, blocks, 1)).value();
  for (int y = 0; y < 2161; y += 7) {
    const std::vector<glm::dvec2> pixels{{0.0, y + 0.5}, {4319.999999, y + 0.5}, {0.5, y + 0.5}, {4319.5, y + 0.5}};
    std::array<cache::HeightSample, 4> heights;
    REQUIRE(raster.sample_heights(0, pixels, heights));
    CHECK(heights[0].metres == doctest::Approx(0.5 * (heights[2].metres + heights[3].metres)));
    CHECK(heights[1].metres == doctest::Approx(heights[0].metres).epsilon(1e-3));
  }
  const geo::LatLon pole{Radians(std::acos(0.0)), Radians(1.0)};
  glm::dvec2 pixel;
  raster.reader().to_pixels({&pole, 1}, {&pixel, 1});
  cache::HeightSample height;
  REQUIRE(raster.sample_heights(0, {&pixel, 1}, {&height, 1}));
  CHECK(height.coverage == 1.0);
  CHECK(height.metres == -4290.0);  // gdallocationinfo; sounded by Mir-1 in 2007: 4261 m deep
}
