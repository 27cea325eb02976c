#include "prepare/gdal/input.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <cpl_conv.h>
#include <cpl_string.h>
#include <fmt/format.h>
#include <gdal_alg.h>
#include <gdal_utils.h>

#include "prepare/gdal/gdal_types.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

constexpr double kWarpTolerance = 0.01;  ///< pixels of an input: GDAL's 0.125 are ten metres on a mountain of pixels of 90

IngestKind guess_kind(GDALDataset& dataset) {
  GDALRasterBand* band = dataset.GetRasterBand(1);
  if (band->GetColorTable() != nullptr || dataset.GetRasterCount() >= 3) return IngestKind::picture;
  const std::string_view unit = band->GetUnitType();
  if (unit == "m" || unit == "metre" || unit == "meter" || unit == "ft") return IngestKind::height;
  const GDALDataType type = band->GetRasterDataType();
  return type == GDT_Byte || type == GDT_UInt16 ? IngestKind::picture : IngestKind::height;
}

int find_alpha(GDALDataset& dataset) {
  for (int i = 1; i <= dataset.GetRasterCount(); ++i) {
    if (dataset.GetRasterBand(i)->GetColorInterpretation() == GCI_AlphaBand) return i;
  }
  return 0;
}

/// A palette's picture as one of red, green, blue and, if it has transparent colours, alpha.
Result<void> expand_palette(Input& input, GDALDatasetUniquePtr& dataset, MemoryFiles& files) {
  const GDALColorTable* table = dataset->GetRasterBand(1)->GetColorTable();
  bool transparent = false;
  for (int i = 0; i < table->GetColorEntryCount(); ++i) transparent = transparent || table->GetColorEntry(i)->c4 < 255;
  CPLStringList arguments;
  for (const char* one : {"-of", "VRT", "-b", "1", "-expand", transparent ? "rgba" : "rgb"}) arguments.AddString(one);
  GDALTranslateOptions* options = GDALTranslateOptionsNew(arguments.List(), nullptr);
  const std::string name = files.add();
  int wrong = 0;
  const source::QuietErrors quiet;
  GDALDatasetUniquePtr expanded(GDALDataset::FromHandle(GDALTranslate(name.c_str(), GDALDataset::ToHandle(dataset.get()), options, &wrong)));
  GDALTranslateOptionsFree(options);
  if (!expanded) return unsupported(input, fmt::format("its colour table cannot be used: {}", quiet.last()));
  expanded.reset();  // before what it was made from
  Result<GDALDatasetUniquePtr> opened = source::open_dataset(name);
  if (!opened) return opened.error();
  dataset = std::move(opened).value();
  input.source = name;
  input.no_data.reset();
  return {};
}

Result<void> inspect_bands(Input& input, GDALDatasetUniquePtr& dataset, const IngestOptions& options, MemoryFiles& files) {
  const int count = dataset->GetRasterCount();
  if (count == 0) {
    char** parts = dataset->GetMetadata("SUBDATASETS");
    const char* first = CSLFetchNameValue(parts, "SUBDATASET_1_NAME");
    return unsupported(input, first != nullptr ? fmt::format("holds several rasters; name one of them as input, for example {}", first) : "holds no raster band");
  }
  GDALRasterBand* band = dataset->GetRasterBand(1);
  input.kind = options.kind.value_or(guess_kind(*dataset));
  int has_no_data = 0;
  const double declared = band->GetNoDataValue(&has_no_data);
  if (has_no_data) input.no_data = declared;
  if (options.no_data) input.no_data = options.no_data;
  if (input.kind == IngestKind::picture && band->GetColorTable() != nullptr) {
    if (Result<void> expanded = expand_palette(input, dataset, files); !expanded) return expanded;
    band = dataset->GetRasterBand(1);
  }
  GDALDataType type = GDT_Byte;
  for (int i = 1; i <= dataset->GetRasterCount(); ++i) {
    GDALRasterBand* one = dataset->GetRasterBand(i);
    const GDALDataType its = one->GetRasterDataType();
    if (GDALDataTypeIsComplex(its)) return unsupported(input, fmt::format("has complex samples ({}); make them real first: gdal_calc.py", GDALGetDataTypeName(its)));
    if (!sample_type(its)) return unsupported(input, fmt::format("has samples of type {}; make them smaller first: gdal_translate -ot Float64 IN OUT.tif", GDALGetDataTypeName(its)));
    if (one->GetColorInterpretation() == GCI_CyanBand) return unsupported(input, "is a picture of printing colours (CMYK); make it one of red, green and blue first");
    type = i == 1 ? its : GDALDataTypeUnion(type, its);
    input.bands.push_back({GDALGetColorInterpretationName(one->GetColorInterpretation()), one->GetDescription(), one->GetUnitType(), one->GetScale(), one->GetOffset()});
  }
  if (input.kind == IngestKind::height && dataset->GetRasterCount() != 1) {
    return unsupported(input, fmt::format("has {} bands, and heights are one; choose it: gdal_translate -b 1 IN OUT.tif", dataset->GetRasterCount()));
  }
  if (!sample_type(type)) return unsupported(input, "has bands of types that go into no common one; give them one: gdal_translate -ot Float64 IN OUT.tif");
  input.type = *sample_type(type);
  band->GetBlockSize(&input.block_x, &input.block_y);
  const char* signedness = band->GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE");
  if (signedness != nullptr && EQUAL(signedness, "SIGNEDBYTE")) return unsupported(input, "has signed samples of 8 bits; widen them first: gdal_translate -ot Int16 IN OUT.tif");
  if (input.kind == IngestKind::height) {
    input.colours = 1;
    if (!input.no_data && input.type == SampleType::i16) input.no_data = kOwnVoid;
    return {};
  }
  input.alpha_band = find_alpha(*dataset);
  input.colours = dataset->GetRasterCount() - (input.alpha_band > 0 ? 1 : 0);
  if (input.colours == 0) return unsupported(input, "holds nothing but alpha");
  if (input.alpha_band > 0 && input.alpha_band != dataset->GetRasterCount()) return unsupported(input, "has its alpha before other bands; put it last: gdal_translate -b");
  input.has_mask = input.alpha_band == 0 && !input.no_data && (band->GetMaskFlags() & GMF_PER_DATASET) != 0;
  const char* bits = band->GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
  if (bits != nullptr && input.type == SampleType::u8 && std::atoi(bits) < 8 && std::atoi(bits) > 0) input.scale_to_byte = 255.0 / ((1 << std::atoi(bits)) - 1);
  return {};
}

}  // namespace

Error unsupported(const Input& input, const std::string& what) { return {ErrorCode::unsupported, fmt::format("{}: {}", input.path, what)}; }

std::string revision_of(GDALDataset& dataset, const std::string& path) {
  std::string text = path;
  char** files = dataset.GetFileList();
  for (int i = 0; i < CSLCount(files); ++i) {
    std::error_code error;
    const auto size = fs::file_size(files[i], error);
    if (error) continue;
    const auto time = fs::last_write_time(files[i], error);
    text += fmt::format("|{} {} {}", files[i], size, time.time_since_epoch().count());
  }
  CSLDestroy(files);
  return text;
}

Result<Input> inspect(const std::string& path, const IngestOptions& options, MemoryFiles& files) {
  Result<GDALDatasetUniquePtr> opened = source::open_dataset(path);
  if (!opened) return opened.error();
  GDALDatasetUniquePtr dataset = std::move(opened).value();
  const source::QuietErrors quiet;
  Input input;
  input.path = path;
  input.source = path;
  input.columns = dataset->GetRasterXSize();
  input.rows = dataset->GetRasterYSize();
  const char* point = dataset->GetMetadataItem(GDALMD_AREA_OR_POINT);
  input.point_samples = point != nullptr && EQUAL(point, GDALMD_AOP_POINT);
  input.revision = revision_of(*dataset, path);
  if (dataset->GetRasterCount() > 0 && dataset->GetGeoTransform(input.transform.data()) != CE_None) {
    const bool points = dataset->GetGCPCount() > 0 || dataset->GetMetadata("RPC") != nullptr;
    return unsupported(input, points ? "is placed by control points only; straighten it first: gdalwarp -t_srs EPSG:4326 IN OUT.tif"
                                     : "says nowhere where it lies; give it a place: gdal_translate -a_srs EPSG:4326 -a_ullr WEST NORTH EAST SOUTH IN OUT.tif");
  }
  if (Result<void> bands = inspect_bands(input, dataset, options, files); !bands) return bands.error();
  const OGRSpatialReference* crs = dataset->GetSpatialRef();
  if (crs == nullptr || crs->IsEmpty() || crs->IsLocal()) {
    return unsupported(input, "says no coordinate system; give it one: gdal_translate -a_srs EPSG:... IN OUT.tif");
  }
  input.crs = *crs;
  input.crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const auto& t = input.transform;
  const double determinant = t[1] * t[5] - t[2] * t[4];
  if (!std::isfinite(t[0]) || !std::isfinite(t[3]) || !std::isfinite(determinant) || determinant == 0.0) return unsupported(input, "its geotransform makes no sense; give it another: gdal_translate -a_ullr");
  input.north_up = t[2] == 0.0 && t[4] == 0.0 && t[1] > 0.0 && t[5] < 0.0;
  return input;
}

Result<Extent> extent_in(const Input& input, const std::string& crs) {
  const auto& t = input.transform;
  if (!input.warped) return Extent{t[0], t[3] + input.rows * t[5], t[0] + input.columns * t[1], t[3], t[1], -t[5]};
  const Result<GDALDatasetUniquePtr> dataset = source::open_dataset(input.source);
  if (!dataset) return dataset.error();
  const source::QuietErrors quiet;
  const std::string own = source::wkt_of(input.crs);
  CPLStringList names;
  names.SetNameValue("SRC_SRS", own.c_str());
  names.SetNameValue("DST_SRS", crs.c_str());
  void* transformer = GDALCreateGenImgProjTransformer2(GDALDataset::ToHandle(dataset.value().get()), nullptr, names.List());
  std::array<double, 6> found{};
  std::array<double, 4> bounds{};
  int width = 0, height = 0;
  const bool good = transformer != nullptr && GDALSuggestedWarpOutput2(GDALDataset::ToHandle(dataset.value().get()), GDALGenImgProjTransform, transformer, found.data(), &width, &height,
                                                                       bounds.data(), 0) == CE_None;
  if (transformer != nullptr) GDALDestroyGenImgProjTransformer(transformer);
  if (!good) return unsupported(input, fmt::format("does not go into the output's coordinate system: {}; choose another by --crs", quiet.last()));
  return Extent{found[0], found[3] + height * found[5], found[0] + width * found[1], found[3], found[1], -found[5]};
}

Result<void> warp(Input& input, const IngestOptions& options, const OutputPlan& plan, MemoryFiles& files) {
  const auto& t = plan.transform;
  const Rectangle& place = input.place;
  const double west = t[0] + place.x * t[1], north = t[3] + place.y * t[5];
  const bool picture = input.kind == IngestKind::picture;
  CPLStringList arguments;
  const auto add = [&](const char* name, auto... values) {
    arguments.AddString(name);
    (arguments.AddString(fmt::format("{}", values).c_str()), ...);
  };
  add("-of", "VRT");
  add("-s_srs", source::wkt_of(input.crs));
  add("-t_srs", plan.crs);
  add("-te", west, north + place.height * t[5], west + place.width * t[1], north);
  add("-ts", place.width, place.height);
  add("-r", options.resampling);
  if (picture) {
    if (input.alpha_band == 0) add("-dstalpha");
    if (input.no_data) add("-srcnodata", *input.no_data);
    add("-wo", "UNIFIED_SRC_NODATA=YES");
  } else {
    if (input.no_data) add("-srcnodata", *input.no_data);
    add("-dstnodata", plan.layout.no_data.value_or(kOwnVoid));
    add("-ot", GDALGetDataTypeName(gdal_type(plan.layout.type)));
  }
  add("-et", kWarpTolerance);
  add("-wm", 16);
  // Else GDAL finds the size of its kernel anew for every piece that it reads, which shows at their borders.
  add("-wo", fmt::format("XSCALE={}", input.fineness));
  add("-wo", fmt::format("YSCALE={}", input.fineness));
  const source::QuietErrors quiet;
  GDALWarpAppOptions* parsed = GDALWarpAppOptionsNew(arguments.List(), nullptr);
  if (parsed == nullptr) return {ErrorCode::invalid_argument, fmt::format("GDAL does not know how to resample: {}", quiet.last())};
  const Result<GDALDatasetUniquePtr> dataset = source::open_dataset(input.source);
  if (!dataset) return dataset.error();
  GDALDatasetH from = GDALDataset::ToHandle(dataset.value().get());
  const std::string name = files.add();
  int wrong = 0;
  GDALDatasetUniquePtr warped(GDALDataset::FromHandle(GDALWarp(name.c_str(), nullptr, 1, &from, parsed, &wrong)));
  GDALWarpAppOptionsFree(parsed);
  if (!warped) return unsupported(input, fmt::format("cannot be brought onto the output's grid: {}", quiet.last()));
  warped->GetRasterBand(1)->GetBlockSize(&input.block_x, &input.block_y);
  if (picture && input.alpha_band == 0) input.alpha_band = warped->GetRasterCount();
  input.source = name;
  input.columns = warped->GetRasterXSize();
  input.rows = warped->GetRasterYSize();
  input.type = plan.layout.type;
  if (!picture) input.no_data = plan.layout.no_data;
  input.has_mask = false;
  return {};
}

}  // namespace tellurion::prepare
