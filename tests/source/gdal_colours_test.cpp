#include <array>
#include <cmath>

#include <doctest/doctest.h>

#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::source;
using test::MadeFile;
using test::MadeRaster;

namespace {

using Colour = std::array<std::uint8_t, 4>;

struct Opened {
  std::unique_ptr<RasterSource> source;
  raster::Image image;
};

Opened colours_of(const MadeRaster& made, GdalOptions options = {}) {
  const MadeFile file("colours.tif", made);
  options.path = file.path();
  Opened result;
  auto source = open_gdal(options, geo::kWgs84);
  REQUIRE_MESSAGE(source, source.error().message);
  result.source = std::move(source).value();
  auto image = result.source->open_reader().value()->read_colours(0, {0, 0, made.width, made.height});
  REQUIRE_MESSAGE(image, image.error().message);
  result.image = std::move(image).value();
  return result;
}

void interpret(GDALDataset& dataset, const std::vector<GDALColorInterp>& bands) {
  for (std::size_t i = 0; i < bands.size(); ++i) dataset.GetRasterBand(static_cast<int>(i) + 1)->SetColorInterpretation(bands[i]);
}

}  // namespace

TEST_CASE("read_colours: grey, grey with alpha, RGB and RGBA, premultiplied") {
  MadeRaster made{.width = 2, .height = 1, .values = {{10, 200}}, .type = GDT_Byte};
  CHECK(colours_of(made).image.at(1, 0) == Colour{200, 200, 200, 255});
  CHECK(colours_of(made).source->description().kind == SampleKind::grey);

  made.values = {{10, 200}, {255, 51}};
  made.adjust = [](GDALDataset& d) { interpret(d, {GCI_GrayIndex, GCI_AlphaBand}); };
  CHECK(colours_of(made).image.at(0, 0) == Colour{10, 10, 10, 255});
  CHECK(colours_of(made).image.at(1, 0) == Colour{40, 40, 40, 51});

  made.values = {{1, 2}, {3, 4}, {5, 6}};
  made.adjust = {};
  CHECK(colours_of(made).image.at(1, 0) == Colour{2, 4, 6, 255});
  CHECK(colours_of(made).source->description().kind == SampleKind::colour);

  made.values = {{100, 100}, {50, 50}, {0, 0}, {255, 0}};
  made.adjust = [](GDALDataset& d) { interpret(d, {GCI_RedBand, GCI_GreenBand, GCI_BlueBand, GCI_AlphaBand}); };
  CHECK(colours_of(made).image.at(0, 0) == Colour{100, 50, 0, 255});
  CHECK(colours_of(made).image.at(1, 0) == Colour{0, 0, 0, 0});
}

TEST_CASE("read_colours: bands are found by their meaning, or by the options") {
  MadeRaster made{.width = 1, .height = 1, .values = {{1}, {2}, {3}}, .type = GDT_Byte};
  made.adjust = [](GDALDataset& d) { interpret(d, {GCI_BlueBand, GCI_GreenBand, GCI_RedBand}); };
  CHECK(colours_of(made).image.at(0, 0) == Colour{3, 2, 1, 255});
  GdalOptions options;
  options.rgb_bands = std::array<int, 3>{2, 2, 1};
  CHECK(colours_of(made, options).image.at(0, 0) == Colour{2, 2, 1, 255});
}

TEST_CASE("read_colours: palettes with transparent entries; what the palette lacks is transparent") {
  MadeRaster made{.width = 3, .height = 1, .values = {{0, 1, 2}}, .type = GDT_Byte};
  made.adjust = [](GDALDataset& d) {
    GDALColorTable table;
    const GDALColorEntry red{255, 0, 0, 255};
    const GDALColorEntry veil{255, 255, 255, 51};
    table.SetColorEntry(0, &red);
    table.SetColorEntry(1, &veil);
    d.GetRasterBand(1)->SetColorTable(&table);
    d.GetRasterBand(1)->SetNoDataValue(2);
  };
  const Opened opened = colours_of(made);
  CHECK(opened.source->description().kind == SampleKind::colour);
  CHECK(opened.image.at(0, 0) == Colour{255, 0, 0, 255});
  CHECK(opened.image.at(2, 0) == Colour{0, 0, 0, 0});
}

TEST_CASE("read_colours: CMYK becomes RGB") {
  MadeRaster made{.width = 1, .height = 1, .values = {{255}, {0}, {51}, {102}}, .type = GDT_Byte};
  made.creation_options = {"PHOTOMETRIC=CMYK"};
  CHECK(colours_of(made).image.at(0, 0) == Colour{0, 153, 122, 255});  // (1 - c)(1 - k)
}

TEST_CASE("read_colours: a pixel is void where all its bands have their no-data value, or where the mask says so") {
  MadeRaster made{.width = 3, .height = 1, .values = {{0, 0, 9}, {0, 7, 9}, {0, 0, 9}}, .type = GDT_Byte, .no_data = 0};
  CHECK(colours_of(made).image.at(0, 0) == Colour{0, 0, 0, 0});
  CHECK(colours_of(made).image.at(1, 0) == Colour{0, 7, 0, 255});
  made.no_data.reset();
  made.adjust = [](GDALDataset& d) {
    REQUIRE(d.CreateMaskBand(GMF_PER_DATASET) == CE_None);
    std::array<GByte, 3> mask{255, 255, 0};
    REQUIRE(d.GetRasterBand(1)->GetMaskBand()->RasterIO(GF_Write, 0, 0, 3, 1, mask.data(), 3, 1, GDT_Byte, 0, 0, nullptr) == CE_None);
  };
  CHECK(colours_of(made).image.at(0, 0) == Colour{0, 0, 0, 255});
  CHECK(colours_of(made).image.at(2, 0) == Colour{0, 0, 0, 0});
}

TEST_CASE("read_colours: 16-bit pictures are stretched from their 2nd to their 98th percentile, voids aside") {
  std::vector<double> samples = test::ramp(100 * 100, 1000, 1);
  samples[0] = 0;
  const MadeRaster made{.width = 100, .height = 100, .values = {samples}, .type = GDT_UInt16, .no_data = 0};
  const raster::Image image = colours_of(made).image;
  CHECK(image.at(0, 0) == Colour{0, 0, 0, 0});
  CHECK(image.at(1, 0) == Colour{0, 0, 0, 255});
  CHECK(image.at(99, 99) == Colour{255, 255, 255, 255});
  CHECK(std::abs(image.at(50, 50)[0] - 128) <= 3);  // sampled, not counted through
  CHECK(colours_of(made).image.rgba == image.rgba);
}

TEST_CASE("read_colours: pictures of few bits reach white") {
  const MadeRaster made{.width = 2, .height = 1, .values = {{0, 1}}, .type = GDT_Byte, .creation_options = {"NBITS=1"}};
  CHECK(colours_of(made).image.at(1, 0) == Colour{255, 255, 255, 255});
}

TEST_CASE("read_colours: JPEG's own smaller sizes serve as levels, and levels are the same picture") {
  const auto path = test::shared_data("earth/imagery/bmng_200405_2048.jpg");
  if (!path) return;
  const auto source = std::move(open_gdal({.path = *path}, geo::kWgs84)).value();
  const auto reader = std::move(source->open_reader()).value();
  const std::vector<LevelSize>& levels = source->description().levels;
  CHECK(levels.size() == 4);
  const auto mean = [&](int level) {
    const LevelSize size = levels[static_cast<std::size_t>(level)];
    const raster::Image image = reader->read_colours(level, {0, 0, size.width, size.height}).value();
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < image.rgba.size(); ++i) {
      if (i % 4 < 3) sum[i % 4] += image.rgba[i];
    }
    for (double& s : sum) s /= static_cast<double>(image.rgba.size() / 4);
    return sum;
  };
  const std::array<double, 3> full = mean(0);
  for (int level = 1; level < 4; ++level) {
    for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(mean(level)[c] - full[c]) < 1.0);
  }
}

TEST_CASE("read_colours: the palette of the clouds is their transparency") {
  const auto path = test::shared_data("earth/imagery/clouds_4096.png");
  if (!path) return;
  const auto source = std::move(open_gdal({.path = *path}, geo::kWgs84)).value();
  const raster::Image image = source->open_reader().value()->read_colours(0, {1000, 1000, 64, 64}).value();
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) REQUIRE(image.rgba[i + c] <= image.rgba[i + 3]);  // premultiplied
  }
}
