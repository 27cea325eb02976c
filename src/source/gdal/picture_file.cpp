#include "source/gdal/picture_file.h"

#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <algorithm>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gdal_priv.h>

#include "source/gdal/gdal_runtime.h"
#include "source/undeclared_voids.h"

namespace tellurion::source {
namespace {

using Dataset = GDALDatasetUniquePtr;

Error cannot_write(const std::filesystem::path& file, const std::string& reason) {
  return {ErrorCode::unavailable, fmt::format("{}: cannot be written{}{}; is the folder there, writable and not full?",
                                              file.string(), reason.empty() ? "" : ": ", reason)};
}

GDALDriver* driver(const char* name) {
  prepare_gdal();
  return GetGDALDriverManager()->GetDriverByName(name);
}

/// Renames `part` to `file` once it is complete.
Result<void> put_in_place(const std::filesystem::path& part, const std::filesystem::path& file) {
  std::error_code failure;
  std::filesystem::rename(part, file, failure);
  if (failure) return Error{ErrorCode::unavailable, fmt::format("{}: {}", file.string(), failure.message())};
  return {};
}

}  // namespace

Result<void> write_png(const std::filesystem::path& file, const raster::Image& image) {
  const QuietErrors quiet;
  GDALDriver* memory = driver("MEM");
  GDALDriver* png = driver("PNG");
  if (!memory || !png) return Error{ErrorCode::unsupported, "this GDAL has no PNG driver"};
  bool opaque = true;
  for (std::size_t i = 3; opaque && i < image.rgba.size(); i += 4) opaque = image.rgba[i] == 255;
  const int channels = opaque ? 3 : 4;
  const Dataset pixels(memory->Create("", image.width, image.height, channels, GDT_Byte, nullptr));
  auto* bytes = const_cast<std::uint8_t*>(image.rgba.data());
  if (!pixels || pixels->RasterIO(GF_Write, 0, 0, image.width, image.height, bytes, image.width, image.height, GDT_Byte, channels,
                                  nullptr, 4, 4 * image.width, 1, nullptr) != CE_None)
    return cannot_write(file, quiet.last());
  for (int band = 1; band <= channels; ++band)
    pixels->GetRasterBand(band)->SetColorInterpretation(static_cast<GDALColorInterp>(GCI_RedBand + band - 1));
  const std::filesystem::path part = file.string() + ".part";
  {
    const Dataset out(png->CreateCopy(part.c_str(), pixels.get(), FALSE, nullptr, nullptr, nullptr));
    if (!out) return cannot_write(file, quiet.last());
  }
  std::error_code ignored;
  std::filesystem::remove(part.string() + ".aux.xml", ignored);
  return put_in_place(part, file);
}

Result<raster::Image> read_picture(const std::filesystem::path& file) {
  const QuietErrors quiet;
  prepare_gdal();
  std::error_code failure;
  if (!std::filesystem::exists(file, failure)) return Error{ErrorCode::not_found, fmt::format("{}: there is no such file", file.string())};
  const Dataset dataset(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER));
  if (!dataset) return Error{ErrorCode::corrupt, fmt::format("{}: not a picture that can be read", file.string())};
  raster::Image image;
  image.width = dataset->GetRasterXSize();
  image.height = dataset->GetRasterYSize();
  image.rgba.assign(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4, 255);
  const int bands = std::min(dataset->GetRasterCount(), 4);
  for (int channel = 0; channel < (bands == 4 ? 4 : 3); ++channel) {
    const int band = bands >= 3 ? channel + 1 : 1;
    if (dataset->GetRasterBand(band)->RasterIO(GF_Read, 0, 0, image.width, image.height, image.rgba.data() + channel, image.width,
                                               image.height, GDT_Byte, 4, 4 * image.width, nullptr) != CE_None)
      return Error{ErrorCode::corrupt, fmt::format("{}: {}", file.string(), quiet.last())};
  }
  return image;
}

namespace {

/// Bytes as a file in GDAL's memory, as long as this lives; the bytes outlive it.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& bytes) : path_(fmt::format("/vsimem/tellurion/{}", static_cast<const void*>(this))) {
    VSILFILE* file = VSIFileFromMemBuffer(path_.c_str(), reinterpret_cast<GByte*>(const_cast<char*>(bytes.data())), bytes.size(), FALSE);
    if (file != nullptr) VSIFCloseL(file);
  }
  ~MemoryFile() { VSIUnlink(path_.c_str()); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// Formats that hold pixels themselves: none that could name other files or hosts.
  Result<Dataset> open(int largest_side) const {
    constexpr std::array kDrivers{"JPEG", "PNG", "WEBP", "GTiff", "GIF", static_cast<const char*>(nullptr)};
    const QuietErrors quiet;
    Dataset dataset(GDALDataset::Open(path_.c_str(), GDAL_OF_RASTER, kDrivers.data()));
    if (!dataset) return Error{ErrorCode::corrupt, quiet.last().empty() ? "is no picture" : quiet.last()};
    if (dataset->GetRasterXSize() > largest_side || dataset->GetRasterYSize() > largest_side)
      return Error{ErrorCode::exhausted, fmt::format("is a picture of {} x {} pixels", dataset->GetRasterXSize(), dataset->GetRasterYSize())};
    if (dataset->GetRasterCount() == 0) return Error{ErrorCode::corrupt, "is a picture without bands"};
    return dataset;
  }

 private:
  std::string path_;
};

/// Whether the pixels are not those that were written: JPEG (alone or in a TIFF) and lossy WebP.
bool is_lossy(GDALDataset& dataset) {
  const auto says = [&](const char* item, std::string_view word) {
    const char* value = dataset.GetMetadataItem(item, "IMAGE_STRUCTURE");
    return value != nullptr && std::string_view(value).find(word) != std::string_view::npos;
  };
  return says("COMPRESSION", "JPEG") || says("COMPRESSION_REVERSIBILITY", "LOSSY");
}

Result<raster::Image> pixels_of(GDALDataset& d) {
  const QuietErrors quiet;
  raster::Image image{d.GetRasterXSize(), d.GetRasterYSize(), {}};
  const std::size_t count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  image.rgba.assign(count * 4, 255);
  // All channels at once: drivers then decode into the image, not through GDAL's cache of blocks.
  const auto read = [&](std::vector<int> of_channels) {
    return d.RasterIO(GF_Read, 0, 0, image.width, image.height, image.rgba.data(), image.width, image.height, GDT_Byte,
                      static_cast<int>(of_channels.size()), of_channels.data(), 4, 4 * image.width, 1, nullptr) == CE_None;
  };
  const int bands = d.GetRasterCount();
  bool good = true;
  if (const GDALColorTable* table = d.GetRasterBand(1)->GetColorTable(); table != nullptr && bands == 1) {
    good = read({1});
    for (std::size_t i = 0; i < count; ++i) {
      GDALColorEntry entry{0, 0, 0, 0};
      table->GetColorEntryAsRGB(image.rgba[4 * i], &entry);
      image.rgba[4 * i] = static_cast<std::uint8_t>(entry.c1);
      image.rgba[4 * i + 1] = static_cast<std::uint8_t>(entry.c2);
      image.rgba[4 * i + 2] = static_cast<std::uint8_t>(entry.c3);
      image.rgba[4 * i + 3] = static_cast<std::uint8_t>(entry.c4);
    }
  } else if (bands < 3) {
    good = read(bands == 1 ? std::vector{1, 1, 1} : std::vector{1, 1, 1, 2});
  } else {
    good = read(bands == 4 ? std::vector{1, 2, 3, 4} : std::vector{1, 2, 3});
  }
  if (!good) return Error{ErrorCode::corrupt, quiet.last()};
  return image;
}

}  // namespace

Result<raster::Image> decode_picture(const std::string& bytes, int largest_side) {
  prepare_gdal();
  const MemoryFile file(bytes);
  const Result<Dataset> dataset = file.open(largest_side);
  return dataset ? pixels_of(**dataset) : Result<raster::Image>(dataset.error());
}

Result<raster::Image> decode_exact_picture(const std::string& bytes, int largest_side) {
  prepare_gdal();
  const MemoryFile file(bytes);
  const Result<Dataset> dataset = file.open(largest_side);
  if (!dataset) return dataset.error();
  if (is_lossy(**dataset))
    return Error{ErrorCode::unsupported, "is compressed with loss, which spoils heights coded as colours; they need PNG or lossless WebP"};
  return pixels_of(**dataset);
}

Result<raster::HeightGrid> decode_height_band(const std::string& bytes, int largest_side) {
  prepare_gdal();
  const MemoryFile file(bytes);
  Result<Dataset> dataset = file.open(largest_side);
  if (!dataset) return dataset.error();
  const QuietErrors quiet;
  GDALRasterBand& band = *dataset.value()->GetRasterBand(1);
  raster::HeightGrid grid{band.GetXSize(), band.GetYSize(), {}};
  grid.metres.resize(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
  if (band.RasterIO(GF_Read, 0, 0, grid.width, grid.height, grid.metres.data(), grid.width, grid.height, GDT_Float32, 0, 0, nullptr) != CE_None)
    return Error{ErrorCode::corrupt, quiet.last()};
  int has = FALSE;
  const auto no_data = static_cast<float>(band.GetNoDataValue(&has));
  const bool int16_voids = has == FALSE && band.GetRasterDataType() == GDT_Int16;
  for (float& metres : grid.metres) {
    if ((has != FALSE && metres == no_data) || (int16_voids && is_int16_void(static_cast<double>(metres))) || !std::isfinite(metres)) metres = raster::kNoHeight;
  }
  return grid;
}

Result<void> write_float64_tiff(const std::filesystem::path& file, int width, int height,
                                std::span<const std::span<const double>> bands, std::span<const std::string> names) {
  assert(names.size() == bands.size());
  const QuietErrors quiet;
  GDALDriver* tiff = driver("GTiff");
  if (!tiff) return Error{ErrorCode::unsupported, "this GDAL has no GeoTIFF driver"};
  const std::filesystem::path part = file.string() + ".part";
  {
    const Dataset out(tiff->Create(part.c_str(), width, height, static_cast<int>(bands.size()), GDT_Float64, nullptr));
    if (!out) return cannot_write(file, quiet.last());
    for (std::size_t i = 0; i < bands.size(); ++i) {
      assert(bands[i].size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      GDALRasterBand* band = out->GetRasterBand(static_cast<int>(i) + 1);
      band->SetDescription(names[i].c_str());
      if (band->RasterIO(GF_Write, 0, 0, width, height, const_cast<double*>(bands[i].data()), width, height, GDT_Float64, 0, 0,
                         nullptr) != CE_None)
        return cannot_write(file, quiet.last());
    }
  }
  return put_in_place(part, file);
}

}  // namespace tellurion::source
