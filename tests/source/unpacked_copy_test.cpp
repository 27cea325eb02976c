#include "source/gdal/unpacked_copy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include "source/gdal/gdal_runtime.h"
#include "source/gdal/gdal_source.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::source;
using tellurion::test::MadeFile;
namespace fs = std::filesystem;

namespace {

constexpr int kWidth = 700, kHeight = 300;

/// A folder of its own, gone with it.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / fmt::format("tellurion_unpacked_{}", getpid())) { fs::create_directories(path_); }
  ~Folder() { fs::remove_all(path_); }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::vector<double> ramp(int step) {
  std::vector<double> values(static_cast<std::size_t>(kWidth) * kHeight);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i * static_cast<std::size_t>(step) % 251);
  return values;
}

MadeFile original() { return MadeFile("whole.tif", {.width = kWidth, .height = kHeight, .values = {ramp(1), ramp(3)}, .type = GDT_Byte}); }

std::vector<double> samples(GDALDataset& dataset, int band) {
  std::vector<double> values(static_cast<std::size_t>(kWidth) * kHeight);
  REQUIRE(dataset.GetRasterBand(band)->RasterIO(GF_Read, 0, 0, kWidth, kHeight, values.data(), kWidth, kHeight, GDT_Float64, 0, 0, nullptr) == CE_None);
  return values;
}

}  // namespace

TEST_CASE("unpacked_copy: tiles of the same samples, made once and anew for other content") {
  const Folder folder;
  const MadeFile made = original();
  const auto from = std::move(open_dataset(made.path())).value();
  const auto file = unpacked_copy(*from, "first", folder.path() / "deep" / "er");
  REQUIRE(file);
  const auto copy = std::move(open_dataset(*file)).value();
  for (const int band : {1, 2}) CHECK(samples(*copy, band) == samples(*from, band));
  int block_width = 0, block_height = 0;
  copy->GetRasterBand(1)->GetBlockSize(&block_width, &block_height);
  CHECK(block_width == 256);
  CHECK(block_height == 256);

  const auto written = fs::last_write_time(*file);
  CHECK(unpacked_copy(*from, "first", folder.path() / "deep" / "er").value() == *file);
  CHECK(fs::last_write_time(*file) == written);
  CHECK(unpacked_copy(*from, "second", folder.path() / "deep" / "er").value() != *file);
  for (const auto& entry : fs::directory_iterator(folder.path() / "deep" / "er")) CHECK(entry.path().extension() == ".tif");
}

TEST_CASE("unpacked_copy: a damaged copy is made again, and what cannot be written is named") {
  const Folder folder;
  const MadeFile made = original();
  const auto from = std::move(open_dataset(made.path())).value();
  const std::string file = unpacked_copy(*from, "first", folder.path()).value();
  std::ofstream(file, std::ios::trunc) << "not a raster";
  CHECK(unpacked_copy(*from, "first", folder.path()).value() == file);
  CHECK(samples(*std::move(open_dataset(file)).value(), 1) == samples(*from, 1));

  std::ofstream(folder.path() / "file") << "in the way";
  const auto refused = unpacked_copy(*from, "first", folder.path() / "file");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::unavailable);
  CHECK(refused.error().message.find((folder.path() / "file").string()) != std::string::npos);
}

TEST_CASE("unpacked_copy: every level of a progressive JPEG shows what lies there, though the copy lacks the overviews that GDAL finds in the JPEG") {
  constexpr int kLarge[2] = {4608, 2560};  // large enough to be copied
  const Folder folder;
  const std::string file = (folder.path() / "large.jpg").string();
  {
    GDALDriver& memory = *GetGDALDriverManager()->GetDriverByName("MEM");
    const GDALDatasetUniquePtr drawn(memory.Create("", kLarge[0], kLarge[1], 3, GDT_Byte, nullptr));
    std::vector<std::uint8_t> row(static_cast<std::size_t>(kLarge[0]));
    for (int band = 1; band <= 3; ++band) {
      for (int y = 0; y < kLarge[1]; ++y) {
        for (int x = 0; x < kLarge[0]; ++x) row[static_cast<std::size_t>(x)] = static_cast<std::uint8_t>(band == 1 ? x * 255 / kLarge[0] : band == 2 ? y * 255 / kLarge[1] : 128);
        REQUIRE(drawn->GetRasterBand(band)->RasterIO(GF_Write, 0, y, kLarge[0], 1, row.data(), kLarge[0], 1, GDT_Byte, 0, 0, nullptr) == CE_None);
      }
    }
    const char* const options[] = {"PROGRESSIVE=ON", "QUALITY=95", nullptr};
    REQUIRE(GDALDatasetUniquePtr(GetGDALDriverManager()->GetDriverByName("JPEG")->CreateCopy(file.c_str(), drawn.get(), FALSE, const_cast<char**>(options), nullptr, nullptr)));
  }
  GdalOptions options;
  options.path = file;
  options.kind = SampleKind::colour;
  options.bounds = {-180.0, -90.0, 180.0, 90.0};
  options.unpack_folder = folder.path().string();
  const auto source = open_gdal(options, geo::kWgs84);
  REQUIRE(source);
  const auto reader = (*source)->open_reader();
  REQUIRE(reader);
  const auto& levels = (*source)->description().levels;
  REQUIRE(levels.size() > 3);
  for (int level = 0; level < static_cast<int>(levels.size()); ++level) {
    const LevelSize& size = levels[static_cast<std::size_t>(level)];
    const PixelWindow window{size.width / 2, size.height / 2, size.width / 3, size.height / 3};
    const auto image = (*reader)->read_colours(level, window);
    REQUIRE(image);
    for (const int step : {0, window.height / 2, window.height - 1}) {
      const auto colour = image->at(step, step);
      CAPTURE(level);
      CHECK(std::abs(colour[0] - (window.x + step + 0.5) / size.width * 255.0) < 4.0);
      CHECK(std::abs(colour[1] - (window.y + step + 0.5) / size.height * 255.0) < 4.0);
    }
  }
  CHECK(std::ranges::any_of(fs::directory_iterator(folder.path()), [](const auto& entry) { return entry.path().extension() == ".tif"; }));
}
