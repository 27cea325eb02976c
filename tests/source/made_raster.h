// Small rasters made through GDAL in memory, and where the larger test data lie.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <cpl_vsi.h>
#include <doctest/doctest.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

namespace tellurion::test {

/// What a raster holds; band b's samples are row-major in values[b].
struct MadeRaster {
  int width = 4;
  int height = 3;
  std::vector<std::vector<double>> values{};
  GDALDataType type = GDT_Int16;
  std::string crs = "EPSG:4326";  ///< empty: none
  std::optional<std::array<double, 6>> transform = std::array<double, 6>{10, 1, 0, 50, 0, -1};
  std::optional<double> no_data{};
  std::vector<std::string> creation_options{};
  std::function<void(GDALDataset&)> adjust{};  ///< anything else
};

/// A GeoTIFF in memory as long as this lives.
class MadeFile {
 public:
  MadeFile(std::string name, const MadeRaster& raster) : path_("/vsimem/" + std::move(name)) {
    GDALAllRegister();
    std::vector<const char*> options;
    for (const std::string& option : raster.creation_options) options.push_back(option.c_str());
    options.push_back(nullptr);
    GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        path_.c_str(), raster.width, raster.height, static_cast<int>(raster.values.size()), raster.type, options.data()));
    REQUIRE(dataset);
    if (raster.transform) {
      std::array<double, 6> transform = *raster.transform;
      REQUIRE(dataset->SetGeoTransform(transform.data()) == CE_None);
    }
    if (!raster.crs.empty()) {
      OGRSpatialReference crs;
      REQUIRE(crs.SetFromUserInput(raster.crs.c_str()) == OGRERR_NONE);
      crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      REQUIRE(dataset->SetSpatialRef(&crs) == CE_None);
    }
    for (std::size_t b = 0; b < raster.values.size(); ++b) {
      GDALRasterBand* band = dataset->GetRasterBand(static_cast<int>(b) + 1);
      if (raster.no_data) band->SetNoDataValue(*raster.no_data);
      std::vector<double> samples = raster.values[b];
      REQUIRE(samples.size() == static_cast<std::size_t>(raster.width) * static_cast<std::size_t>(raster.height));
      REQUIRE(band->RasterIO(GF_Write, 0, 0, raster.width, raster.height, samples.data(), raster.width, raster.height, GDT_Float64, 0, 0,
                             nullptr) == CE_None);
    }
    if (raster.adjust) raster.adjust(*dataset);
  }
  ~MadeFile() {
    VSIUnlink(path_.c_str());
    VSIUnlink((path_ + ".aux.xml").c_str());
    VSIUnlink((path_ + ".msk").c_str());
  }
  MadeFile(const MadeFile&) = delete;
  MadeFile& operator=(const MadeFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// `count` samples: first, first + step, ...
inline std::vector<double> ramp(int count, double first = 0.0, double step = 1.0) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(first + i * step);
  return values;
}

/// The path of a file of the larger test data; nothing, with a message, where they are missing.
inline std::optional<std::string> shared_data(const std::string& name) {
  const std::string path = std::string(TELLURION_SHARED_DATA_DIR) + "/" + name;
  if (std::filesystem::exists(path)) return path;
  MESSAGE("skipped: no " << path);
  return std::nullopt;
}

}  // namespace tellurion::test
