#include "source/gdal/unpacked_copy.h"

#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include "source/gdal/gdal_runtime.h"
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
