#include "source/gdal/gdal_runtime.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include <cpl_conv.h>
#include <cpl_vsi_virtual.h>
#include <fmt/format.h>
#include <ogr_srs_api.h>

#include "source/gdal/gdal_source.h"

namespace tellurion::source {
namespace {

constexpr std::array kNetworkFileSystems{"/vsicurl",  "/vsicurl_streaming", "/vsis3",     "/vsis3_streaming",    "/vsigs",  "/vsigs_streaming",
                                         "/vsiaz",    "/vsiaz_streaming",   "/vsiadls",   "/vsioss",             "/vsioss_streaming",
                                         "/vsiswift", "/vsiswift_streaming", "/vsihdfs",  "/vsiwebhdfs"};
constexpr std::array kNetworkDrivers{"WMS",     "WMTS",  "WCS",  "HTTP",  "PLMOSAIC", "PLSCENES", "DAAS",         "EEDA",
                                     "EEDAI",   "NGW",   "OGCAPI", "STACTA", "STACIT",   "Rasterlite", "PostGISRaster", "RASDAMAN",
                                     "Elastic", "WFS",   "OAPIF", "CSW",   "Carto",    "AmigoCloud"};
constexpr std::array kNetworkSchemes{"http://", "https://", "ftp://", "WMS:", "WMTS:", "WCS:"};

constexpr const char* kNoNetwork = "GDAL's network access is off; download the file, or give the URL of tiles as a source of type \"xyz\"";

/// Stands in for a network file system, which it owns, and refuses to open anything.
class RefusedFileSystem final : public VSIFilesystemHandler {
 public:
  explicit RefusedFileSystem(std::unique_ptr<VSIFilesystemHandler> refused) : refused_(std::move(refused)) {}

  VSIVirtualHandle* Open(const char* name, const char*, bool, CSLConstList) override {
    CPLError(CE_Failure, CPLE_OpenFailed, "%s: %s", name, kNoNetwork);
    return nullptr;
  }
  int Stat(const char* name, VSIStatBufL*, int) override {
    CPLError(CE_Failure, CPLE_OpenFailed, "%s: %s", name, kNoNetwork);
    return -1;
  }

 private:
  std::unique_ptr<VSIFilesystemHandler> refused_;
};

void refuse_network_file_systems() {
  std::map<VSIFilesystemHandler*, std::vector<std::string>> prefixes_of;  // one may serve several
  for (const char* name : kNetworkFileSystems) {
    for (const char* end : {"/", "?"}) {
      VSIFilesystemHandler* handler = VSIFileManager::GetHandler((std::string(name) + end).c_str());
      prefixes_of[handler].push_back(std::string(name) + end);
    }
  }
  prefixes_of.erase(VSIFileManager::GetHandler("."));  // plain files: GDAL was built without those
  for (const auto& [handler, prefixes] : prefixes_of) {
    VSIFilesystemHandler* refused = std::make_unique<RefusedFileSystem>(std::unique_ptr<VSIFilesystemHandler>(handler)).release();  // GDAL owns it
    for (const std::string& prefix : prefixes) VSIFileManager::InstallHandler(prefix, refused);
  }
}

bool begins_with_any(std::string_view text, auto&& prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](const char* prefix) { return text.starts_with(prefix); });
}

}  // namespace

void prepare_gdal() {
  static std::once_flag once;
  std::call_once(once, [] {
    const QuietErrors quiet;
    GDALAllRegister();
    std::string skipped = CPLGetConfigOption("GDAL_SKIP", "");
    for (const char* name : kNetworkDrivers) {
      if (GetGDALDriverManager()->GetDriverByName(name) != nullptr) skipped += std::string(" ") + name;
    }
    CPLSetConfigOption("GDAL_SKIP", skipped.c_str());
    GDALAllRegister();  // takes them out, and whoever calls it again does not bring them back
    refuse_network_file_systems();
    OSRSetPROJEnableNetwork(FALSE);
  });
}

QuietErrors::QuietErrors() {
  CPLPushErrorHandlerEx(
      [](CPLErr severity, CPLErrorNum, const char* message) {
        if (severity < CE_Failure) return;
        std::string& last = static_cast<QuietErrors*>(CPLGetErrorHandlerUserData())->last_;
        last = message;
        std::replace(last.begin(), last.end(), '\n', ' ');
      },
      this);
}

QuietErrors::~QuietErrors() {
  CPLPopErrorHandler();
  CPLErrorReset();
}

void configure_gdal(std::size_t block_cache_bytes) {
  prepare_gdal();
  GDALSetCacheMax64(static_cast<GIntBig>(block_cache_bytes));
}

std::size_t gdal_cache_bytes() { return static_cast<std::size_t>(GDALGetCacheUsed64()); }

std::string wkt_of(const OGRSpatialReference& crs) {
  constexpr std::array<const char*, 2> kFormat{"FORMAT=WKT2_2019", nullptr};
  char* text = nullptr;
  crs.exportToWkt(&text, kFormat.data());
  const std::string wkt(text != nullptr ? text : "");
  CPLFree(text);
  return wkt;
}

Result<GDALDatasetUniquePtr> open_dataset(const std::string& path) {
  prepare_gdal();
  if (begins_with_any(path, kNetworkSchemes)) return Error{ErrorCode::unsupported, fmt::format("{}: {}", path, kNoNetwork)};
  const QuietErrors quiet;
  GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (dataset) return dataset;
  if (begins_with_any(path, kNetworkFileSystems)) return Error{ErrorCode::unsupported, fmt::format("{}: {}", path, kNoNetwork)};
  VSIStatBufL stat;
  if (VSIStatL(path.c_str(), &stat) != 0) {
    const bool plain = path.find(':') == std::string::npos;
    return Error{ErrorCode::not_found, plain ? fmt::format("{}: no such file", path) : fmt::format("{}: cannot be opened: {}", path, quiet.last())};
  }
  if (VSI_ISDIR(stat.st_mode)) return Error{ErrorCode::unsupported, fmt::format("{}: is a folder, not a raster file", path)};
  const bool known = quiet.last().find("not recognized") == std::string::npos;
  if (known) return Error{ErrorCode::corrupt, fmt::format("{}: GDAL cannot read it: {}", path, quiet.last())};
  const std::string extension = CPLGetExtension(path.c_str());
  if (EQUAL(extension.c_str(), "img")) {
    return Error{ErrorCode::unsupported, fmt::format("{}: a planetary image needs its label beside it, a file of the same name ending in .lbl", path)};
  }
  return Error{ErrorCode::unsupported, fmt::format("{}: no raster format that GDAL knows; gdalinfo --formats lists them", path)};
}

}  // namespace tellurion::source
