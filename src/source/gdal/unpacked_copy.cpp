#include "source/gdal/unpacked_copy.h"

#include <array>
#include <random>
#include <system_error>

#include <fmt/format.h>

#include "base/hash.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::source {
namespace {

bool holds(const std::string& file, GDALDataset& original) {
  const Result<GDALDatasetUniquePtr> copy = open_dataset(file);
  return copy && copy.value()->GetRasterXSize() == original.GetRasterXSize() &&
         copy.value()->GetRasterYSize() == original.GetRasterYSize() && copy.value()->GetRasterCount() == original.GetRasterCount();
}

}  // namespace

Result<std::string> unpacked_copy(GDALDataset& dataset, const std::string& revision, const std::filesystem::path& folder) {
  const std::string file = (folder / fmt::format("{:016x}.tif", fnv1a(revision))).string();
  if (holds(file, dataset)) return file;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string part = fmt::format("{}.{}.part", file, std::random_device{}());
  const QuietErrors quiet;
  constexpr std::array kOptions{"TILED=YES", "COMPRESS=DEFLATE", "ZLEVEL=1", "PREDICTOR=2", "NUM_THREADS=ALL_CPUS", "BIGTIFF=IF_SAFER",
                                static_cast<const char*>(nullptr)};
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const auto failure = [&](const std::string& why) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    return Error{ErrorCode::unavailable, fmt::format("{} cannot be written: {}", file, why)};
  };
  if (driver == nullptr) return failure("GDAL has no GTiff driver");
  GDALDatasetUniquePtr copy(driver->CreateCopy(part.c_str(), &dataset, FALSE, const_cast<char**>(kOptions.data()), nullptr, nullptr));
  if (!copy) return failure(quiet.last());
  // What is still buffered is written by closing; GDAL tells of failures by errors alone.
  copy.reset();
  if (!quiet.last().empty() || !holds(part, dataset)) return failure(quiet.last());
  std::filesystem::rename(part, file, error);
  if (error) return failure(error.message());
  std::filesystem::remove(part + ".aux.xml", error);
  return file;
}

}  // namespace tellurion::source
