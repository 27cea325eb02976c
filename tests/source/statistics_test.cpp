#include <cmath>

#include <doctest/doctest.h>

#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"
#include "source/statistics.h"

using namespace tellurion;
using namespace tellurion::source;

namespace {

Result<RasterStatistics> statistics(const test::MadeFile& file, SampleKind kind, double most_samples = INFINITY) {
  GdalOptions options;
  options.path = file.path();
  options.kind = kind;
  const auto source = open_gdal(options, geo::kWgs84);
  REQUIRE(source);
  return statistics_of(**source, most_samples);
}

}  // namespace

TEST_CASE("statistics_of: heights as GDAL computes them, without what is no data") {
  test::MadeRaster raster;
  raster.width = 1500;  // more than is read at a time
  raster.height = 1100;
  raster.transform = {10.0, 1e-3, 0.0, 50.0, 0.0, -1e-3};
  raster.no_data = -9999.0;
  raster.values.emplace_back();
  for (int i = 0; i < raster.width * raster.height; ++i) raster.values[0].push_back(i % 7 == 0 ? -9999.0 : 1000.0 + (i * 37) % 2003);
  const test::MadeFile file("statistics.tif", raster);
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(file.path().c_str()));
  double least = 0, largest = 0, mean = 0, deviation = 0;
  REQUIRE(dataset->GetRasterBand(1)->ComputeStatistics(false, &least, &largest, &mean, &deviation, nullptr, nullptr) == CE_None);

  const auto all = statistics(file, SampleKind::height);
  REQUIRE(all);
  CHECK(all->level == 0);
  REQUIRE(all->bands.size() == 1);
  CHECK(all->bands[0].least == least);
  CHECK(all->bands[0].largest == largest);
  CHECK(all->bands[0].mean == doctest::Approx(mean).epsilon(1e-9));
  CHECK(all->bands[0].deviation == doctest::Approx(deviation).epsilon(1e-9));
  CHECK(all->share_there == doctest::Approx(6.0 / 7.0).epsilon(1e-5));

  const auto coarse = statistics(file, SampleKind::height, 1e6);
  REQUIRE(coarse);
  CHECK(coarse->level == 1);
  CHECK(coarse->bands[0].mean == doctest::Approx(mean).epsilon(0.01));
}

TEST_CASE("statistics_of: pictures, transparent pixels left out; nothing there is no number") {
  test::MadeRaster raster;
  raster.width = 4;
  raster.height = 1;
  raster.type = GDT_Byte;
  raster.values = {{10, 20, 30, 200}, {0, 0, 0, 200}, {255, 255, 255, 200}, {255, 255, 255, 0}};
  raster.adjust = [](GDALDataset& dataset) { dataset.GetRasterBand(4)->SetColorInterpretation(GCI_AlphaBand); };
  const test::MadeFile file("picture_statistics.tif", raster);
  const auto colours = statistics(file, SampleKind::colour);
  REQUIRE(colours);
  REQUIRE(colours->bands.size() == 3);
  CHECK(colours->bands[0].mean == doctest::Approx(20.0));
  CHECK(colours->bands[0].deviation == doctest::Approx(std::sqrt(200.0 / 3.0)));
  CHECK(colours->bands[1].largest == 0.0);
  CHECK(colours->bands[2].least == 255.0);
  CHECK(colours->share_there == 0.75);

  test::MadeRaster empty;
  empty.no_data = 5.0;
  empty.values = {std::vector<double>(12, 5.0)};
  const auto none = statistics(test::MadeFile("empty_statistics.tif", empty), SampleKind::height);
  REQUIRE(none);
  CHECK(none->share_there == 0.0);
  CHECK(std::isnan(none->bands[0].mean));
}
