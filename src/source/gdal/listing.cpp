#include "source/catalogue/listing.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <cpl_conv.h>
#include <cpl_string.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include "source/catalogue/list_maker.h"
#include "source/catalogue/stac_list.h"
#include "source/catalogue/vrt_mosaic.h"
#include "source/gdal/gdal_runtime.h"
#include "source/gdal/raster_index.h"
#include "source/grid_coverage.h"
#include "source/proj/pixel_mapping.h"

namespace tellurion::source {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20;  ///< of a VRT or JSON file
constexpr int kDeepest = 64;                                      ///< folders within folders

// --- Folders ---------------------------------------------------------------------------------------------------------

/// In lower case, with its dot.
std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

/// Endings of rasters, as drivers tell them, without those of side files and of what is mostly no raster.
std::set<std::string> raster_endings() {
  constexpr std::array kNone{".xml", ".ovr", ".msk", ".tfw", ".wld", ".txt", ".json", ".html", ".pdf", ".csv", ".hdr", ".err",
                             ".gpkg", ".sqlite", ".db", ".dwg", ".kml", ".kmz", ".rda"};
  prepare_gdal();
  std::set<std::string> endings;
  GDALDriverManager& drivers = *GetGDALDriverManager();
  for (int i = 0; i < drivers.GetDriverCount(); ++i) {
    GDALDriver* driver = drivers.GetDriver(i);
    if (driver->GetMetadataItem(GDAL_DCAP_RASTER) == nullptr) continue;
    for (const char* item : {GDAL_DMD_EXTENSIONS, GDAL_DMD_EXTENSION}) {
      const char* told = driver->GetMetadataItem(item);
      const CPLStringList words(CSLTokenizeString(told != nullptr ? told : ""));
      for (int word = 0; word < words.size(); ++word) endings.insert(ending_of(fmt::format("file.{}", words[word])));
    }
  }
  for (const char* none : kNone) endings.erase(none);
  endings.erase("");
  return endings;
}

class FolderSearch {
 public:
  FolderSearch(std::string name, const std::set<std::string>& endings) : endings_(endings), made_(std::move(name)) {}

  /// Looks into `folder`, which is `depth` folders down.
  void search(const fs::path& folder, int depth) {
    std::error_code failure;
    const fs::path real = fs::canonical(folder, failure);
    if (failure || !seen_.insert(real).second) return;  // by another way, or in a circle
    std::set<fs::path> entries;
    fs::directory_iterator entry(folder, failure);
    for (; !failure && entry != fs::directory_iterator(); entry.increment(failure)) entries.insert(entry->path());
    if (failure) made_.leave_out(fmt::format("{}: cannot be searched: {}.", folder.string(), failure.message()));
    for (const fs::path& path : entries) {
      if (path.filename().string().starts_with('.')) continue;
      if (fs::is_directory(path, failure)) {
        if (depth < kDeepest) search(path, depth + 1);
        else made_.leave_out(fmt::format("{}: lies too many folders deep and was not searched.", path.string()));
      } else if (endings_.contains(ending_of(path)) && fs::is_regular_file(path, failure) && !is_part_of_another(path, entries)) {
        if (!made_.add({path.string(), {}, Metres(0.0)})) return;
      }
    }
  }

  Result<RasterList> finish() && {
    Result<RasterList> list = std::move(made_).finish();
    if (list) std::ranges::sort(list->rasters, {}, &ListedRaster::path);
    return list;
  }

 private:
  /// The samples of planetary images lie beside their labels, which are the rasters.
  static bool is_part_of_another(const fs::path& path, const std::set<fs::path>& entries) {
    if (ending_of(path) != ".img") return false;
    return std::ranges::any_of(std::array{".lbl", ".LBL"}, [&](const char* ending) { return entries.contains(fs::path(path).replace_extension(ending)); });
  }

  const std::set<std::string>& endings_;
  ListMaker made_;
  std::set<fs::path> seen_;
};

Result<RasterList> list_folder(const fs::path& folder, const std::string& name) {
  static const std::set<std::string> endings = raster_endings();
  FolderSearch search(name, endings);
  search.search(folder, 0);
  return std::move(search).finish();
}

// --- VRTs ------------------------------------------------------------------------------------------------------------

/// A VRT's CRS as the rasters' own are read; empty if it says none that counts.
Result<std::string> wkt_as_said(const std::string& said) {
  if (said.empty()) return std::string();
  const QuietErrors quiet;
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(said.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) != OGRERR_NONE)
    return Error{ErrorCode::corrupt, fmt::format("PROJ does not know its SRS {}", in_quotes(said))};
  if (crs.IsEmpty() || crs.IsLocal()) return std::string();
  return wkt_of(crs);
}

/// Puts the part's ring and spacing into `raster`, if it has a place throughout.
void place(const VrtPart& part, PixelMapping& mapping, const geo::Ellipsoid& world, ListedRaster& raster) {
  const std::vector<glm::dvec2> pixels = ring_of_rectangle(part.lower, part.upper);
  std::vector<geo::LatLon> ring(pixels.size());
  mapping.to_places(pixels, ring);
  if (!std::ranges::all_of(ring, [](const geo::LatLon& p) { return std::isfinite(p.latitude.value) && std::isfinite(p.longitude.value); })) return;
  join_longitudes(ring);
  raster.ring = std::move(ring);
  if (!(part.reduction.x > 0.0 && part.reduction.y > 0.0)) return;
  // A pixel's width and height on the ground, each by its own reduction: spacing_at is asked for one of the part's own pixels.
  const glm::dvec2 middle = (part.lower + part.upper) / 2.0;
  const Metres spacing = spacing_at(middle * part.reduction, world, [&](std::span<const glm::dvec2> own, std::span<geo::LatLon> places) {
    std::vector<glm::dvec2> in_mosaic;
    for (const glm::dvec2& pixel : own) in_mosaic.push_back(pixel / part.reduction);
    mapping.to_places(in_mosaic, places);
  });
  if (std::isfinite(spacing.value)) raster.spacing = spacing;
}

Result<RasterList> list_vrt(std::string_view text, const fs::path& folder, const std::string& name, const geo::Ellipsoid& world) {
  Result<VrtMosaic> mosaic = parse_vrt(text, folder, name);
  if (!mosaic) return mosaic.error();
  const auto named = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", name, error.message)}; };
  const Result<std::string> wkt = wkt_as_said(mosaic->crs);
  if (!wkt) return named(wkt.error());
  std::optional<PixelMapping> mapping;
  if (mosaic->transform && !wkt->empty()) {
    Result<PixelMapping> made = PixelMapping::create({*wkt, *mosaic->transform, mosaic->width, mosaic->height}, world);
    if (!made) return named(made.error());
    mapping.emplace(std::move(made).value());
  }
  RasterList list{{}, std::move(mosaic->problems)};
  list.rasters.reserve(mosaic->parts.size());
  for (VrtPart& part : mosaic->parts) {
    ListedRaster& raster = list.rasters.emplace_back();
    raster.path = std::move(part.path);
    if (mapping) place(part, *mapping, world, raster);
  }
  return list;
}

Result<std::string> text_of_file(const fs::path& file, const std::string& name) {
  std::error_code failure;
  const std::uintmax_t size = fs::file_size(file, failure);
  if (failure) return Error{ErrorCode::unavailable, fmt::format("{}: cannot be read: {}", name, failure.message())};
  if (size > kMostBytes) return Error{ErrorCode::exhausted, fmt::format("{}: has {} MB, more than the {} MB that are read of a list", name, size >> 20, kMostBytes >> 20)};
  std::string text(static_cast<std::size_t>(size), '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(text.data(), static_cast<std::streamsize>(size))) return Error{ErrorCode::unavailable, fmt::format("{}: cannot be read; may it be?", name)};
  return text;
}

}  // namespace

Result<RasterList> list_rasters(const std::filesystem::path& path, const geo::Ellipsoid& world) {
  const std::string name = path.string();
  std::error_code failure;
  const fs::path whole = fs::absolute(path, failure).lexically_normal();
  const fs::file_status status = fs::status(whole, failure);
  if (!fs::exists(status)) return Error{ErrorCode::not_found, fmt::format("{}: no such file or folder", name)};
  if (fs::is_directory(status)) return list_folder(whole, name);
  if (!fs::is_regular_file(status)) return Error{ErrorCode::unsupported, fmt::format("{}: is neither a file nor a folder", name)};
  const std::string ending = ending_of(whole);
  const bool is_vrt = ending == ".vrt";
  if (!is_vrt && ending != ".json" && ending != ".geojson") return read_raster_index(whole, name, world);
  Result<std::string> text = text_of_file(whole, name);
  if (!text) return text.error();
  if (is_vrt) return list_vrt(*text, whole.parent_path(), name, world);
  Result<RasterList> list = read_stac(*text, whole.parent_path(), name, world);
  if (list || list.error().code != ErrorCode::unsupported) return list;
  Result<RasterList> index = read_raster_index(whole, name, world);  // gdaltindex writes GeoJSON, too
  return index || index.error().code != ErrorCode::unsupported ? index : list;
}

}  // namespace tellurion::source
