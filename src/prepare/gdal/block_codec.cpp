#include "prepare/gdal/block_codec.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>
#include <string_view>

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include "prepare/gdal/gdal_types.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::prepare {
namespace {

constexpr std::uint16_t kSubfileType = 254, kWidth = 256, kHeight = 257;
/// What says where a raster lies and what its numbers mean stands in the first directory only.
constexpr std::array<std::uint16_t, 8> kFirstOnly{270, 33550, 33922, 34264, 34735, 34736, 34737, 42112};

/// A name of a file in memory that is removed at the end.
class MemoryFile {
 public:
  MemoryFile() {
    static std::atomic<std::uint64_t> count{0};
    name_ = fmt::format("/vsimem/tellurion-ingest-block-{}.tif", ++count);
  }
  ~MemoryFile() {
    VSIUnlink(name_.c_str());
    VSIUnlink((name_ + ".aux.xml").c_str());
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const char* name() const { return name_.c_str(); }
  std::span<const std::byte> bytes() const {
    vsi_l_offset size = 0;
    const GByte* data = VSIGetMemFileBuffer(name_.c_str(), &size, FALSE);
    return {reinterpret_cast<const std::byte*>(data), static_cast<std::size_t>(size)};
  }

 private:
  std::string name_;
};

CPLStringList creation_options(const OutputPlan& plan) {
  CPLStringList options;
  const auto set = [&](const char* name, const auto& value) { options.SetNameValue(name, fmt::format("{}", value).c_str()); };
  const Codec& codec = plan.codec;
  set("COMPRESS", codec.compress);
  set("TILED", "YES");
  set("BLOCKXSIZE", plan.block);
  set("BLOCKYSIZE", plan.block);
  set("INTERLEAVE", "PIXEL");
  set("ENDIANNESS", "LITTLE");
  set("BIGTIFF", "NO");
  set("NUM_THREADS", 1);
  if (codec.compress == "DEFLATE" || codec.compress == "ZSTD") set("PREDICTOR", codec.predictor);
  if (codec.compress == "DEFLATE") set("ZLEVEL", codec.level);
  if (codec.compress == "ZSTD") set("ZSTD_LEVEL", codec.level);
  if (codec.compress == "JPEG") set("JPEG_QUALITY", codec.quality);
  if (codec.compress == "WEBP") {
    set("WEBP_LEVEL", codec.quality);
    if (codec.quality == 100) set("WEBP_LOSSLESS", "YES");
  }
  const int colours = plan.layout.bands - (plan.layout.alpha ? 1 : 0);
  if (codec.compress == "JPEG" && colours == 3) set("PHOTOMETRIC", "YCBCR");
  else set("PHOTOMETRIC", colours == 3 && plan.bands[0].colour == "Red" ? "RGB" : "MINISBLACK");
  return options;
}

/// A file of one block in memory. `more` may say more of the data set before it is closed.
template <class More>
Result<void> write_file(const OutputPlan& plan, const Samples& block, const MemoryFile& file, More&& more) {
  const source::QuietErrors quiet;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  if (driver == nullptr) return {ErrorCode::unsupported, "GDAL has no GTiff driver"};
  const GDALDataType type = gdal_type(plan.layout.type);
  const CPLStringList options = creation_options(plan);
  GDALDatasetUniquePtr dataset(driver->Create(file.name(), plan.block, plan.block, plan.layout.bands, type, const_cast<char**>(options.List())));
  const auto failure = [&] { return Error{ErrorCode::internal, fmt::format("GDAL cannot compress by {}: {}", plan.codec.compress, quiet.last())}; };
  if (!dataset) return failure();
  if (plan.layout.alpha) dataset->GetRasterBand(plan.layout.bands)->SetColorInterpretation(GCI_AlphaBand);
  more(*dataset);
  const auto pixel = static_cast<GSpacing>(plan.layout.pixel_bytes());
  const CPLErr written = dataset->RasterIO(GF_Write, 0, 0, plan.block, plan.block, const_cast<std::byte*>(block.bytes.data()), plan.block, plan.block, type, plan.layout.bands,
                                           nullptr, pixel, pixel * plan.block, static_cast<GSpacing>(bytes_of(plan.layout.type)), nullptr);
  dataset.reset();
  if (written != CE_None || !quiet.last().empty()) return failure();
  return {};
}

void describe(const OutputPlan& plan, const std::vector<BandStatistics>& bands, GDALDataset& dataset) {
  OGRSpatialReference crs;
  crs.importFromWkt(plan.crs.c_str());
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (plan.point_samples) dataset.SetMetadataItem(GDALMD_AREA_OR_POINT, GDALMD_AOP_POINT);
  dataset.SetSpatialRef(&crs);
  std::array<double, 6> transform = plan.transform;
  dataset.SetGeoTransform(transform.data());
  for (std::size_t i = 0; i < bands.size(); ++i) {
    GDALRasterBand* band = dataset.GetRasterBand(static_cast<int>(i) + 1);
    const BandAbout& about = plan.bands[i];
    if (!about.description.empty()) band->SetDescription(about.description.c_str());
    if (!about.unit.empty()) band->SetUnitType(about.unit.c_str());
    if (about.scale != 1.0) band->SetScale(about.scale);
    if (about.offset != 0.0) band->SetOffset(about.offset);
    const BandStatistics& found = bands[i];
    if (found.count == 0) continue;
    const auto count = static_cast<double>(found.count), mean = found.sum / count;
    const auto set = [&](const char* name, double value) { band->SetMetadataItem(name, fmt::format("{}", value).c_str()); };
    set("STATISTICS_MINIMUM", found.least);
    set("STATISTICS_MAXIMUM", found.most);
    set("STATISTICS_MEAN", mean);
    set("STATISTICS_STDDEV", std::sqrt(std::max(found.sum_of_squares / count - mean * mean, 0.0)));
    band->SetMetadataItem("STATISTICS_VALID_PERCENT", fmt::format("{:.4g}", 100.0 * count / (static_cast<double>(plan.width) * plan.height)).c_str());
  }
}

void set_no_data(const OutputPlan& plan, GDALDataset& dataset) {
  if (plan.layout.no_data) dataset.GetRasterBand(1)->SetNoDataValue(*plan.layout.no_data);
}

}  // namespace

Result<void> check_codec(const std::string& compress) {
  source::prepare_gdal();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const char* options = driver != nullptr ? driver->GetMetadataItem(GDAL_DMD_CREATIONOPTIONLIST) : nullptr;
  const std::string_view list(options != nullptr ? options : "");
  if (compress == "NONE" || list.find(fmt::format("<Value>{}</Value>", compress)) != std::string_view::npos) return {};
  return {ErrorCode::unsupported, fmt::format("this GDAL does not compress by {}; DEFLATE always works", compress)};
}

Result<std::vector<std::byte>> compress_block(const OutputPlan& plan, const Samples& block) {
  const MemoryFile file;
  if (Result<void> written = write_file(plan, block, file, [&](GDALDataset& dataset) { set_no_data(plan, dataset); }); !written) return written.error();
  const auto bytes = file.bytes();
  const Result<TiffDirectory> directory = read_directory(bytes);
  if (!directory) return directory.error();
  const TiffField* where = find_field(*directory, kTileOffsetsTag);
  const TiffField* lengths = find_field(*directory, kTileByteCountsTag);
  const auto offset = where != nullptr ? numbers_of(*where) : std::vector<std::uint64_t>{}, length = lengths != nullptr ? numbers_of(*lengths) : std::vector<std::uint64_t>{};
  if (offset.size() != 1 || length.size() != 1 || length[0] == 0 || offset[0] > bytes.size() || length[0] > bytes.size() - offset[0]) {
    return {ErrorCode::internal, "GDAL wrote no block"};
  }
  const auto block_bytes = bytes.subspan(offset[0], length[0]);
  return std::vector<std::byte>(block_bytes.begin(), block_bytes.end());
}

Result<std::vector<TiffDirectory>> describe_levels(const OutputPlan& plan, const std::vector<BandStatistics>& bands) {
  const MemoryFile file;
  // A block that is not blank, so that GDAL writes it and all the fields that go with it.
  Samples block = make_samples(plan.layout, plan.block, plan.block);
  std::fill(block.bytes.begin(), block.bytes.end(), std::byte{1});
  const auto more = [&](GDALDataset& dataset) {
    set_no_data(plan, dataset);
    describe(plan, bands, dataset);
  };
  if (Result<void> written = write_file(plan, block, file, more); !written) return written.error();
  Result<TiffDirectory> first = read_directory(file.bytes());
  if (!first) return first.error();
  std::vector<TiffDirectory> levels;
  int width = plan.width, height = plan.height;
  for (int level = 0; level < plan.level_count(); ++level) {
    TiffDirectory directory = *first;
    if (level > 0) {
      std::erase_if(directory, [](const TiffField& field) { return std::find(kFirstOnly.begin(), kFirstOnly.end(), field.tag) != kFirstOnly.end(); });
      set_field(directory, long_field(kSubfileType, 1));  // a smaller version of another image
      width = (width + 1) / 2;
      height = (height + 1) / 2;
    }
    set_field(directory, long_field(kWidth, static_cast<std::uint32_t>(width)));
    set_field(directory, long_field(kHeight, static_cast<std::uint32_t>(height)));
    levels.push_back(std::move(directory));
  }
  return levels;
}

}  // namespace tellurion::prepare
