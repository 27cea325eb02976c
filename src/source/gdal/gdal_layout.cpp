#include "source/gdal/gdal_layout.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

#include <cpl_string.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ogr_spatialref.h>

#include "source/gdal/gdal_runtime.h"
#include "source/gdal/jpeg_header.h"
#include "source/gdal/unpacked_copy.h"
#include "source/length_unit.h"
#include "source/undeclared_voids.h"

namespace tellurion::source {
namespace {

constexpr int kCoarsestSide = 256;  ///< the last level fits into this

Error unsupported(const GdalOptions& options, const std::string& what) { return {ErrorCode::unsupported, fmt::format("{}: {}", options.path, what)}; }
Error invalid(const GdalOptions& options, const std::string& what) { return {ErrorCode::invalid_argument, fmt::format("{}: {}", options.path, what)}; }

// --- Where it lies ---------------------------------------------------------------------------------------------------

Result<std::string> crs_wkt(GDALDataset& dataset, const GdalOptions& options) {
  OGRSpatialReference given;
  const OGRSpatialReference* crs = dataset.GetSpatialRef();
  if (options.crs) {
    if (given.SetFromUserInput(options.crs->c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) != OGRERR_NONE) {
      return invalid(options, fmt::format("PROJ does not know crs = \"{}\"; write a code like \"EPSG:4326\", a PROJ string or WKT", *options.crs));
    }
    crs = &given;
  }
  if (crs == nullptr || crs->IsEmpty()) {
    return unsupported(options, "says no coordinate system; give it one: crs = \"EPSG:...\" in the world file, or gdal_translate -a_srs EPSG:...");
  }
  if (crs->IsLocal()) return unsupported(options, "has a local coordinate system only; give the right one: crs = \"EPSG:...\" in the world file");
  const std::string wkt = wkt_of(*crs);
  if (wkt.empty()) return unsupported(options, "has a coordinate system that cannot be written as WKT; give it one: crs = \"EPSG:...\"");
  return wkt;
}

Result<Georeference> find_georeference(GDALDataset& dataset, const GdalOptions& options, const geo::Ellipsoid& world) {
  Georeference result;
  result.width = dataset.GetRasterXSize();
  result.height = dataset.GetRasterYSize();
  if (options.bounds) {
    const auto [west, south, east, north] = *options.bounds;
    result.crs = geographic_crs(world);
    result.transform = {west, (east - west) / result.width, 0.0, north, 0.0, (south - north) / result.height};
    return result;
  }
  if (dataset.GetGeoTransform(result.transform.data()) != CE_None) {
    if (dataset.GetGCPCount() > 0 || dataset.GetMetadata("RPC") != nullptr) {
      return unsupported(options, "is placed by control points only; straighten it first: gdalwarp -t_srs EPSG:4326 IN OUT.tif");
    }
    return unsupported(options, "says nowhere where it lies; give it a place: gdal_translate -a_srs EPSG:4326 -a_ullr WEST NORTH EAST SOUTH IN OUT.tif");
  }
  Result<std::string> wkt = crs_wkt(dataset, options);
  if (!wkt) return wkt.error();
  result.crs = std::move(wkt).value();
  return result;
}

// --- Levels ----------------------------------------------------------------------------------------------------------

LevelSize size_of(GDALRasterBand& band) { return {band.GetXSize(), band.GetYSize()}; }

/// Overviews that all of `bands` have.
std::vector<LevelSize> overviews_of(GDALDataset& dataset, const std::vector<int>& bands) {
  std::vector<LevelSize> sizes;
  GDALRasterBand* first = dataset.GetRasterBand(bands.front());
  for (int i = 0; i < first->GetOverviewCount(); ++i) {
    GDALRasterBand* overview = first->GetOverview(i);
    if (overview == nullptr) break;
    const LevelSize size = size_of(*overview);
    const bool everywhere = std::all_of(bands.begin(), bands.end(), [&](int number) {
      GDALRasterBand* band = dataset.GetRasterBand(number);
      GDALRasterBand* other = i < band->GetOverviewCount() ? band->GetOverview(i) : nullptr;
      return other != nullptr && other->GetXSize() == size.width && other->GetYSize() == size.height;
    });
    sizes.push_back(everywhere ? size : LevelSize{});
  }
  return sizes;
}

/// An overview of 0.4 to 0.6 of the level before is taken as it is; else a level is half of it, made from the smallest
/// overview that is not smaller.
void plan_levels(GdalLayout& layout, LevelSize full, const std::vector<LevelSize>& overviews) {
  layout.description.levels = {full};
  layout.levels = {LevelPlan{-1, true}};
  while (std::max(layout.description.levels.back().width, layout.description.levels.back().height) > kCoarsestSide) {
    const LevelSize before = layout.description.levels.back();
    LevelSize next{(before.width + 1) / 2, (before.height + 1) / 2};
    LevelPlan plan;
    double nearest = 0.1;
    int smallest_base = full.width;
    for (std::size_t i = 0; i < overviews.size(); ++i) {
      const LevelSize& size = overviews[i];
      if (size.width <= 0) continue;
      const double off = std::max(std::abs(static_cast<double>(size.width) / before.width - 0.5),
                                  before.height < 4 ? 0.0 : std::abs(static_cast<double>(size.height) / before.height - 0.5));
      if (off < nearest) {
        nearest = off;
        plan = {static_cast<int>(i), true};
      } else if (!plan.direct && size.width >= next.width && size.height >= next.height && size.width < smallest_base) {
        smallest_base = size.width;
        plan.overview = static_cast<int>(i);
      }
    }
    if (plan.direct) next = overviews[static_cast<std::size_t>(plan.overview)];
    layout.description.levels.push_back(next);
    layout.levels.push_back(plan);
  }
}

// --- What the samples are --------------------------------------------------------------------------------------------

std::optional<double> no_data_of(GDALRasterBand& band, const GdalOptions& options) {
  if (options.no_data) return options.no_data;
  int has = FALSE;
  const double value = band.GetNoDataValue(&has);
  return has ? std::optional<double>(value) : std::nullopt;
}

bool contains_word(std::string text, std::initializer_list<const char*> words) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::any_of(words.begin(), words.end(), [&](const char* word) { return text.find(word) != std::string::npos; });
}

/// Metres of one unit of the band; nothing if it names no length.
std::optional<double> unit_of(GDALRasterBand& band) { return metres_of_unit(band.GetUnitType()); }

SampleKind guess_kind(GDALDataset& dataset) {
  GDALRasterBand* band = dataset.GetRasterBand(1);
  if (band->GetColorTable() != nullptr || dataset.GetRasterCount() >= 3) return SampleKind::colour;
  if (unit_of(*band) || contains_word(band->GetDescription(), {"elevation", "height", "dem", "altitude", "depth"})) return SampleKind::height;
  const GDALDataType type = band->GetRasterDataType();
  return type == GDT_Byte || type == GDT_UInt16 ? SampleKind::grey : SampleKind::height;
}

HeightPlan plan_heights(GDALRasterBand& band, const GdalOptions& options, const geo::Ellipsoid& world) {
  HeightPlan plan;
  plan.no_data = no_data_of(band, options);
  plan.int16_voids = !plan.no_data && band.GetRasterDataType() == GDT_Int16;
  plan.unit = options.scale ? 1.0 : unit_of(band).value_or(1.0);
  plan.scale = options.scale.value_or(band.GetScale());
  plan.offset = options.offset.value_or(band.GetOffset());
  // Planetary grids may give distances from the body's centre.
  plan.from_centre = std::abs(plan.offset * plan.unit - world.a()) < 0.02 * world.a();
  if (plan.from_centre) plan.offset -= world.a() / plan.unit;
  plan.limit_metres = height_limit(world);
  return plan;
}

std::vector<std::array<std::uint8_t, 4>> read_palette(const GDALColorTable& table, std::optional<double> no_data) {
  std::vector<std::array<std::uint8_t, 4>> colours;
  for (int i = 0; i < table.GetColorEntryCount(); ++i) {
    GDALColorEntry entry{};
    table.GetColorEntryAsRGB(i, &entry);
    const int alpha = no_data && *no_data == i ? 0 : std::clamp<int>(entry.c4, 0, 255);
    const auto premultiplied = [alpha](int c) { return static_cast<std::uint8_t>((std::clamp(c, 0, 255) * alpha + 127) / 255); };
    colours.push_back({premultiplied(entry.c1), premultiplied(entry.c2), premultiplied(entry.c3), static_cast<std::uint8_t>(alpha)});
  }
  return colours;
}

Result<ColourPlan> plan_colours(GDALDataset& dataset, const GdalOptions& options) {
  const int count = dataset.GetRasterCount();
  const auto find = [&](GDALColorInterp wanted) {
    for (int i = 1; i <= count; ++i) {
      if (dataset.GetRasterBand(i)->GetColorInterpretation() == wanted) return i;
    }
    return 0;
  };
  ColourPlan plan;
  plan.alpha_band = find(GCI_AlphaBand);
  GDALRasterBand* first = dataset.GetRasterBand(1);
  if (options.rgb_bands) {
    for (const int band : *options.rgb_bands) {
      if (band < 1 || band > count) return invalid(options, fmt::format("has {} bands, but rgb_bands names band {}", count, band));
    }
    plan.model = ColourModel::rgb;
    plan.bands.assign(options.rgb_bands->begin(), options.rgb_bands->end());
  } else if (first->GetColorTable() != nullptr) {
    plan.model = ColourModel::palette;
    plan.bands = {1};
    plan.palette = read_palette(*first->GetColorTable(), no_data_of(*first, options));
    if (plan.palette.empty()) return unsupported(options, "has an empty colour table");
  } else if (find(GCI_CyanBand) && find(GCI_MagentaBand) && find(GCI_YellowBand) && find(GCI_BlackBand)) {
    plan.model = ColourModel::cmyk;
    plan.bands = {find(GCI_CyanBand), find(GCI_MagentaBand), find(GCI_YellowBand), find(GCI_BlackBand)};
  } else if (find(GCI_RedBand) && find(GCI_GreenBand) && find(GCI_BlueBand)) {
    plan.model = ColourModel::rgb;
    plan.bands = {find(GCI_RedBand), find(GCI_GreenBand), find(GCI_BlueBand)};
  } else if (count - (plan.alpha_band ? 1 : 0) >= 3) {
    plan.model = ColourModel::rgb;
    for (int i = 1; plan.bands.size() < 3; ++i) {
      if (i != plan.alpha_band) plan.bands.push_back(i);
    }
  } else {
    plan.bands = {plan.alpha_band == 1 && count > 1 ? 2 : 1};
  }
  for (const int band : plan.bands) plan.no_data.push_back(no_data_of(*dataset.GetRasterBand(band), options));
  GDALRasterBand* colour = dataset.GetRasterBand(plan.bands.front());
  if (colour->GetRasterDataType() == GDT_Byte) {
    const char* bits = colour->GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
    const int depth = bits != nullptr ? std::clamp(std::atoi(bits), 1, 8) : 8;
    plan.full_scale = static_cast<double>((1 << depth) - 1);
  }
  return plan;
}

// --- Which content ---------------------------------------------------------------------------------------------------

std::string revision_of(GDALDataset& dataset, const GdalOptions& options) {
  std::string text = options.path;
  char** files = dataset.GetFileList();
  for (int i = 0; i < CSLCount(files); ++i) {
    VSIStatBufL stat;
    if (VSIStatL(files[i], &stat) == 0 && !std::string_view(files[i]).starts_with(kRemotePrefix)) text += fmt::format("|{} {} {}", files[i], stat.st_size, static_cast<long long>(stat.st_mtime));
  }
  CSLDestroy(files);
  const auto add = [&](const char* name, const auto& option) {
    if (option) text += fmt::format("|{}={}", name, *option);
  };
  add("crs", options.crs);
  add("vertical", options.vertical);
  add("no_data", options.no_data);
  add("scale", options.scale);
  add("offset", options.offset);
  if (options.bounds) text += fmt::format("|bounds={}", fmt::join(*options.bounds, ","));
  if (options.kind) text += fmt::format("|kind={}", static_cast<int>(*options.kind));
  if (options.rgb_bands) text += fmt::format("|rgb={},{},{}", (*options.rgb_bands)[0], (*options.rgb_bands)[1], (*options.rgb_bands)[2]);
  return text;
}

/// In words.
std::string encoding_of(GDALDataset& dataset, const GdalOptions& options) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  std::string text = dataset.GetDriverName();
  const char* compression = dataset.GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE");
  if (compression != nullptr) text += fmt::format(", {}", compression);
  int width = 0, height = 0;
  band.GetBlockSize(&width, &height);
  text += fmt::format(", blocks of {} x {}", width, height);
  if (const auto no_data = no_data_of(band, options)) text += fmt::format(", no-data {}", *no_data);
  const double scale = options.scale.value_or(band.GetScale()), offset = options.offset.value_or(band.GetOffset());
  if (scale != 1.0 || offset != 0.0) text += fmt::format(", scale {}, offset {}", scale, offset);
  return text;
}

}  // namespace

Result<GdalLayout> inspect(GDALDataset& dataset, const GdalOptions& options, const geo::Ellipsoid& world) {
  const QuietErrors quiet;
  GdalLayout layout;
  layout.options = options;
  layout.file = options.path;
  layout.world = world;
  RasterDescription& about = layout.description;
  about.name = options.path;
  about.band_count = dataset.GetRasterCount();
  if (about.band_count == 0) {
    char** parts = dataset.GetMetadata("SUBDATASETS");
    const char* first = CSLFetchNameValue(parts, "SUBDATASET_1_NAME");
    return first != nullptr ? unsupported(options, fmt::format("holds several rasters; name one of them as path, for example {}", first))
                            : unsupported(options, "holds no raster band");
  }
  const GDALDataType type = dataset.GetRasterBand(1)->GetRasterDataType();
  about.sample_type = GDALGetDataTypeName(type);
  about.encoding = encoding_of(dataset, options);
  if (GDALDataTypeIsComplex(type)) return unsupported(options, fmt::format("has complex samples ({}); make them real first: gdal_calc.py", about.sample_type));

  Result<Georeference> georeference = find_georeference(dataset, options, world);
  if (!georeference) return georeference.error();
  layout.georeference = std::move(georeference).value();
  about.crs_wkt = layout.georeference.crs;

  about.kind = options.kind.value_or(guess_kind(dataset));
  Result<ColourPlan> colours = plan_colours(dataset, options);
  if (!colours) return colours.error();
  layout.colours = std::move(colours).value();

  std::vector<int> bands{1};
  if (about.kind != SampleKind::height) {
    bands = layout.colours.bands;
    if (layout.colours.alpha_band) bands.push_back(layout.colours.alpha_band);
  }
  layout.revision = revision_of(dataset, options);
  GDALDatasetUniquePtr copied;  // what is read in the place of `dataset`, if anything is
  constexpr double kCoefficientBytes = 2.0, kManyBytes = 64e6;
  const double decoder_bytes = kCoefficientBytes * about.band_count * layout.georeference.width * layout.georeference.height;
  if (decoder_bytes > kManyBytes && is_progressive_jpeg(options.path)) {
    const Result<std::string> copy = options.unpack_folder.empty() ? Error{ErrorCode::unavailable, "there is no cache folder for a copy that can"}
                                                                   : unpacked_copy(dataset, layout.revision, options.unpack_folder);
    if (Result<GDALDatasetUniquePtr> opened = copy ? open_dataset(copy.value()) : copy.error(); opened) {
      layout.file = copy.value();
      copied = std::move(opened).value();
    } else {
      about.hints.push_back(fmt::format("{} is a progressive JPEG, which cannot be read in parts: it is decoded whole, again and again, and takes {:.0f} MB "
                                        "more for each worker ({}); gdal_translate -of COG makes a file without that.",
                                        options.path, decoder_bytes / 1e6, opened.error().message));
    }
  }
  // Overviews were made with the file's own no-data value: another one has been averaged into them.
  const bool own_voids = options.no_data && no_data_of(*dataset.GetRasterBand(1), GdalOptions{}) != options.no_data;
  plan_levels(layout, size_of(*dataset.GetRasterBand(1)), own_voids ? std::vector<LevelSize>{} : overviews_of(copied ? *copied : dataset, bands));
  constexpr double kManySamples = 2e8;
  if (static_cast<double>(layout.georeference.width) * layout.georeference.height > kManySamples && about.levels.size() > 1 && layout.levels[1].overview < 0) {
    about.hints.push_back(fmt::format("{} is large and has no overviews, which makes it slow from afar: run gdaladdo on it once.", options.path));
  }
  layout.heights = plan_heights(*dataset.GetRasterBand(1), options, world);
  return layout;
}

}  // namespace tellurion::source
