#include "source/gdal/picture_file.h"

#include <cassert>
#include <algorithm>

#include <fmt/format.h>
#include <gdal_priv.h>

#include "source/gdal/gdal_runtime.h"

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
