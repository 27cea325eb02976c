#include "prepare/gdal/inputs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <cpl_conv.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_alg.h>
#include <gdal_utils.h>
#include <ogr_spatialref.h>

#include "base/hash.h"
#include "prepare/gdal/gdal_types.h"
#include "prepare/gdal/memory_files.h"
#include "source/gdal/gdal_runtime.h"
#include "source/undeclared_voids.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

constexpr double kPixelTolerance = 1e-3;  ///< pixels: grids that differ by less are the same
constexpr double kWarpTolerance = 0.01;   ///< pixels of an input: GDAL's 0.125 are ten metres on a mountain of pixels of 90
constexpr double kOwnVoid = -32768.0;     ///< where voids need a value and no input names one

/// A rectangle in pixels of the output.
struct Rectangle {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
};

struct Input {
  std::string path;
  std::string source;         ///< what is read in its place: itself, or a virtual raster of it
  int columns = 0;
  int rows = 0;
  int block_x = 0;
  int block_y = 0;
  bool point_samples = false;
  OGRSpatialReference crs;
  std::array<double, 6> transform{};
  IngestKind kind = IngestKind::height;
  SampleType type = SampleType::f32;
  std::vector<BandAbout> bands;
  std::optional<double> no_data;
  int colours = 0;            ///< bands without alpha
  int alpha_band = 0;         ///< 0: none
  bool has_mask = false;      ///< beside the bands, for all of them
  double scale_to_byte = 1.0; ///< of pictures of fewer than 8 bits
  bool north_up = true;
  std::string revision;
  bool warped = false;
  double fineness = 1.0;      ///< output pixels for one of its own, where it is warped
  Rectangle place;            ///< on the output's grid
};

Error unsupported(const Input& input, const std::string& what) { return {ErrorCode::unsupported, fmt::format("{}: {}", input.path, what)}; }

// --- Each input ------------------------------------------------------------------------------------------------------

Result<OGRSpatialReference> crs_from(const std::string& text, const char* option) {
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(text.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) != OGRERR_NONE || crs.IsEmpty()) {
    return {ErrorCode::invalid_argument, fmt::format("PROJ does not know {} \"{}\"; write a code like EPSG:4326, a PROJ string or WKT", option, text)};
  }
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return crs;
}

/// Names, sizes and times of all files that a data set is made of.
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

/// Files and, of folders, the rasters in them, by name.
Result<std::vector<std::string>> list_inputs(const IngestOptions& options) {
  source::prepare_gdal();
  std::vector<std::string> paths;
  for (const std::string& input : options.inputs) {
    std::error_code error;
    if (!fs::is_directory(input, error)) {
      paths.push_back(input);
      continue;
    }
    if (GDALIdentifyDriverEx(input.c_str(), GDAL_OF_RASTER, nullptr, nullptr) != nullptr) {  // a format that is a folder
      paths.push_back(input);
      continue;
    }
    const source::QuietErrors quiet;
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(input, error)) {
      const std::string name = entry.path().string();
      if (entry.is_regular_file(error) && GDALIdentifyDriverEx(name.c_str(), GDAL_OF_RASTER, nullptr, nullptr) != nullptr) found.push_back(name);
    }
    if (found.empty()) return {ErrorCode::not_found, fmt::format("{}: holds no raster that GDAL opens", input)};
    std::sort(found.begin(), found.end());
    paths.insert(paths.end(), found.begin(), found.end());
  }
  std::error_code error;
  for (const std::string& path : paths) {
    if (fs::equivalent(path, options.out, error)) return {ErrorCode::invalid_argument, fmt::format("{}: is input and output at once; name another output", path)};
  }
  if (paths.empty()) return {ErrorCode::invalid_argument, "there is nothing to prepare; name a raster or a folder of them"};
  return paths;
}

// --- The grid --------------------------------------------------------------------------------------------------------

/// The vertical part of a CRS; empty if it has none.
OGRSpatialReference vertical_part(const OGRSpatialReference& crs) {
  OGRSpatialReference vertical;
  const OGR_SRSNode* node = crs.GetAttrNode("COMPD_CS") != nullptr ? crs.GetAttrNode("VERT_CS") : nullptr;
  if (node == nullptr) return vertical;
  char* text = nullptr;
  node->exportToWkt(&text);
  if (text != nullptr) vertical.importFromWkt(text);
  CPLFree(text);
  return vertical;
}

Result<void> put_on(OGRSpatialReference& crs, const OGRSpatialReference& vertical) {
  OGRSpatialReference horizontal = crs, compound;
  horizontal.StripVertical();
  if (compound.SetCompoundCS(fmt::format("{} + {}", horizontal.GetName(), vertical.GetName()).c_str(), &horizontal, &vertical) != OGRERR_NONE) {
    return {ErrorCode::invalid_argument, fmt::format("{} and {} make no common coordinate system", horizontal.GetName(), vertical.GetName())};
  }
  compound.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  crs = compound;
  return {};
}

/// The CRS of the output without what `options.vertical` says, which re-labels heights and does not change them.
Result<OGRSpatialReference> target_crs(const IngestOptions& options, const std::vector<Input>& inputs) {
  OGRSpatialReference crs = inputs.front().crs;
  if (!options.crs) return crs;
  Result<OGRSpatialReference> wanted = crs_from(*options.crs, "--crs");
  if (!wanted) return wanted;
  const OGRSpatialReference vertical = vertical_part(inputs.front().crs);
  if (wanted->IsCompound() || vertical.IsEmpty()) return wanted;
  if (Result<void> put = put_on(*wanted, vertical); !put) return put.error();
  return wanted;
}

Result<void> declare_vertical(const IngestOptions& options, OGRSpatialReference& crs) {
  if (!options.vertical) return {};
  if (*options.vertical == "ellipsoid") {
    crs.StripVertical();
    if (crs.PromoteTo3D(nullptr) != OGRERR_NONE) return {ErrorCode::invalid_argument, fmt::format("{} takes no heights above its ellipsoid", crs.GetName())};
    crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    return {};
  }
  Result<OGRSpatialReference> vertical = crs_from(*options.vertical == "egm96" ? "EPSG:5773" : *options.vertical, "--vertical");
  if (!vertical) return vertical.error();
  if (!vertical->IsVertical() || vertical->IsCompound()) return {ErrorCode::invalid_argument, fmt::format("--vertical \"{}\" is no vertical datum; write ellipsoid, egm96 or a code like EPSG:3855", *options.vertical)};
  return put_on(crs, *vertical);
}

bool same_crs(const OGRSpatialReference& a, const OGRSpatialReference& b) {
  constexpr std::array<const char*, 3> kRelaxed{"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS", nullptr};
  return a.IsSame(&b, kRelaxed.data()) != 0;
}

struct Extent {
  double west = 0.0, south = 0.0, east = 0.0, north = 0.0;
  double pixel_x = 0.0, pixel_y = 0.0;
};

/// Where an input lies in the output's CRS, and how fine it is there.
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

/// Chooses resolution, extent and size; says of every input where it lies.
Result<void> choose_grid(const IngestOptions& options, std::vector<Input>& inputs, OutputPlan& plan, const std::string& crs) {
  std::vector<Extent> extents;
  std::size_t anchor = 0;  // whose pixels are copied as they are
  for (const Input& input : inputs) {
    Result<Extent> extent = extent_in(input, crs);
    if (!extent) return extent.error();
    extents.push_back(*extent);
    const Extent& best = extents[anchor];
    if (extent->pixel_x * extent->pixel_y < best.pixel_x * best.pixel_y * (1.0 - 1e-9)) anchor = extents.size() - 1;
  }
  const double pixel_x = options.resolution.value_or(extents[anchor].pixel_x), pixel_y = options.resolution.value_or(extents[anchor].pixel_y);
  const double origin_x = extents[anchor].west, origin_y = extents[anchor].north;
  const auto first = [](double at) { return std::floor(at + kPixelTolerance); };
  const auto last = [](double at) { return std::ceil(at - kPixelTolerance); };
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const Extent& extent = extents[i];
    Rectangle& place = inputs[i].place;
    place = {(extent.west - origin_x) / pixel_x, (origin_y - extent.north) / pixel_y, (extent.east - extent.west) / pixel_x, (extent.north - extent.south) / pixel_y};
    const std::array<double, 4> edges{first(place.x), first(place.y), last(place.x + place.width), last(place.y + place.height)};
    left = i == 0 ? edges[0] : std::min(left, edges[0]);
    top = i == 0 ? edges[1] : std::min(top, edges[1]);
    right = i == 0 ? edges[2] : std::max(right, edges[2]);
    bottom = i == 0 ? edges[3] : std::max(bottom, edges[3]);
    inputs[i].fineness = std::sqrt(extent.pixel_x * extent.pixel_y / (pixel_x * pixel_y));
    if (inputs[i].warped) place = {edges[0], edges[1], edges[2] - edges[0], edges[3] - edges[1]};
  }
  constexpr double kMostPixels = 1 << 30;
  if (!(right - left >= 1.0 && bottom - top >= 1.0 && right - left <= kMostPixels && bottom - top <= kMostPixels)) {
    return {ErrorCode::invalid_argument, fmt::format("the output would have {:.0f} x {:.0f} pixels; say another --resolution", right - left, bottom - top)};
  }
  for (Input& input : inputs) {
    input.place.x -= left;
    input.place.y -= top;
    for (double* number : {&input.place.x, &input.place.y, &input.place.width, &input.place.height}) {
      if (std::abs(*number - std::round(*number)) < kPixelTolerance) *number = std::round(*number);
    }
  }
  plan.transform = {origin_x + left * pixel_x, pixel_x, 0.0, origin_y - top * pixel_y, 0.0, -pixel_y};
  plan.width = static_cast<int>(right - left);
  plan.height = static_cast<int>(bottom - top);
  return {};
}

// --- Samples ---------------------------------------------------------------------------------------------------------

/// Whether the inputs leave no pixel of the grid free.
bool cover_all(const std::vector<Input>& inputs, const OutputPlan& plan) {
  double area = 0.0;
  for (const Input& input : inputs) {
    if (input.warped) return false;
    area += input.place.width * input.place.height;
  }
  if (area != static_cast<double>(plan.width) * plan.height || inputs.size() > 5000) return false;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Rectangle &a = inputs[i].place, &b = inputs[j].place;
      if (a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height) return false;
    }
  }
  return true;
}

bool holds(SampleType type, double value) {
  const auto within = [value](auto least, auto most) { return value >= static_cast<double>(least) && value <= static_cast<double>(most) && std::floor(value) == value; };
  switch (type) {
    case SampleType::u8:
      return within(0, 255);
    case SampleType::u16:
      return within(0, 65535);
    case SampleType::i16:
      return within(-32768, 32767);
    case SampleType::u32:
      return within(0.0, 4294967295.0);
    case SampleType::i32:
      return within(-2147483648.0, 2147483647.0);
    case SampleType::f32:
    case SampleType::f64:
      return true;
  }
  return false;
}

void choose_height_samples(const std::vector<Input>& inputs, OutputPlan& plan) {
  SampleLayout& layout = plan.layout;
  for (const Input& input : inputs) {
    if (!layout.no_data && input.no_data && holds(layout.type, *input.no_data)) layout.no_data = input.no_data;
  }
  if (layout.no_data || cover_all(inputs, plan)) return;
  if (layout.type == SampleType::u8) layout.type = SampleType::i16;
  if (layout.type == SampleType::u16) layout.type = SampleType::i32;
  if (layout.type == SampleType::u32) layout.type = SampleType::f64;
  layout.no_data = kOwnVoid;
}

Result<void> choose_samples(const std::vector<Input>& inputs, OutputPlan& plan) {
  const Input& first = inputs.front();
  SampleLayout& layout = plan.layout;
  GDALDataType type = gdal_type(first.type);
  bool transparent = false;
  for (const Input& input : inputs) {
    if (input.kind != first.kind) return {ErrorCode::invalid_argument, fmt::format("{} are heights and {} is a picture; prepare them apart, or say --kind", first.kind == IngestKind::height ? first.path : input.path, first.kind == IngestKind::height ? input.path : first.path)};
    if (input.colours != first.colours) return {ErrorCode::invalid_argument, fmt::format("{} has {} bands of colour and {} has {}; prepare them apart", first.path, first.colours, input.path, input.colours)};
    type = GDALDataTypeUnion(type, gdal_type(input.type));
    transparent = transparent || input.alpha_band > 0 || input.has_mask || input.no_data;
    const BandAbout &ours = first.bands.front(), &its = input.bands.front();
    if (ours.scale != its.scale || ours.offset != its.offset || (ours.unit != its.unit && !ours.unit.empty() && !its.unit.empty())) {
      return {ErrorCode::invalid_argument, fmt::format("{} and {} count in different units (scale, offset or unit of their bands); bring them to one first: gdal_translate -unscale -ot Float32 IN OUT.tif", first.path, input.path)};
    }
  }
  if (!sample_type(type)) return unsupported(first, "and the other inputs have no common type of samples; bring them to one first: gdal_translate -ot");
  layout.type = *sample_type(type);
  if (first.kind == IngestKind::height) {
    choose_height_samples(inputs, plan);
  } else {
    if (inputs.size() > 1 && first.type != layout.type) return unsupported(first, "and other pictures have samples of different depth; bring them to one first: gdal_translate -ot Byte -scale");
    layout.alpha = transparent || !cover_all(inputs, plan);
  }
  layout.bands = first.colours + (layout.alpha ? 1 : 0);
  for (int i = 1; i <= layout.bands; ++i) {
    BandAbout about;
    if (i <= first.colours) {
      about = first.bands[static_cast<std::size_t>(i - 1)];
      if (first.kind == IngestKind::picture && first.colours == 3) about.colour = std::array{"Red", "Green", "Blue"}[static_cast<std::size_t>(i - 1)];
    } else {
      about.colour = "Alpha";
    }
    plan.bands.push_back(std::move(about));
  }
  return {};
}

Result<void> choose_codec(const IngestOptions& options, const std::vector<Input>& inputs, OutputPlan& plan) {
  const IngestKind kind = inputs.front().kind;
  const bool palettes = std::any_of(inputs.begin(), inputs.end(), [](const Input& input) { return input.source != input.path; });
  const SampleLayout& layout = plan.layout;
  const bool colours = layout.type == SampleType::u8 && layout.bands - (layout.alpha ? 1 : 0) == 3;
  Codec& codec = plan.codec;
  codec.level = options.level;
  codec.quality = options.quality;
  codec.compress = options.compress.value_or(kind == IngestKind::height || !colours || palettes ? "DEFLATE" : layout.alpha ? "WEBP" : "JPEG");
  if (codec.compress == "JPEG" && (layout.type != SampleType::u8 || layout.alpha)) {
    return {ErrorCode::invalid_argument, layout.alpha ? "JPEG has no transparency, and these pictures leave parts of the output free; say --compress webp or deflate"
                                                      : "JPEG takes samples of 8 bits only; say --compress deflate"};
  }
  if (codec.compress == "WEBP" && !colours) return {ErrorCode::invalid_argument, "WEBP takes pictures of 8 bits in red, green and blue only; say --compress deflate"};
  if (kind == IngestKind::height && (codec.compress == "JPEG" || codec.compress == "WEBP")) {
    return {ErrorCode::invalid_argument, fmt::format("{} changes heights; say --compress deflate or zstd", codec.compress)};
  }
  codec.predictor = is_float(layout.type) ? 3 : 2;
  return {};
}

// --- The mosaic ------------------------------------------------------------------------------------------------------

std::string escaped(const std::string& text) {
  char* xml = CPLEscapeString(text.c_str(), static_cast<int>(text.size()), CPLES_XML);
  std::string result(xml);
  CPLFree(xml);
  return result;
}

/// An input in another grid as one of the output's, computed while it is read.
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

std::string source_xml(const Input& input, const IngestOptions& options, const OutputPlan& plan, int band) {
  const bool is_alpha = plan.layout.alpha && band == plan.layout.bands;
  const Rectangle& place = input.place;
  const bool same_size = place.width == input.columns && place.height == input.rows && place.x == std::round(place.x) && place.y == std::round(place.y);
  std::string text = fmt::format("<ComplexSource{}>", same_size ? "" : fmt::format(" resampling=\"{}\"", options.resampling));
  text += fmt::format("<SourceFilename relativeToVRT=\"0\" shared=\"0\">{}</SourceFilename>", escaped(input.source));
  if (is_alpha && input.has_mask) text += "<SourceBand>mask,1</SourceBand>";
  else text += fmt::format("<SourceBand>{}</SourceBand>", is_alpha ? std::max(input.alpha_band, 1) : band);
  text += fmt::format("<SourceProperties RasterXSize=\"{}\" RasterYSize=\"{}\" DataType=\"{}\" BlockXSize=\"{}\" BlockYSize=\"{}\"/>", input.columns, input.rows,
                      GDALGetDataTypeName(gdal_type(input.type)), input.block_x, input.block_y);
  text += fmt::format("<SrcRect xOff=\"0\" yOff=\"0\" xSize=\"{}\" ySize=\"{}\"/>", input.columns, input.rows);
  text += fmt::format("<DstRect xOff=\"{}\" yOff=\"{}\" xSize=\"{}\" ySize=\"{}\"/>", place.x, place.y, place.width, place.height);
  if (is_alpha && input.alpha_band == 0 && !input.has_mask) text += fmt::format("<ScaleOffset>{}</ScaleOffset><ScaleRatio>0</ScaleRatio>", plan.layout.type == SampleType::u16 ? 65535 : 255);
  else if (input.scale_to_byte != 1.0) text += fmt::format("<ScaleOffset>0</ScaleOffset><ScaleRatio>{}</ScaleRatio>", input.scale_to_byte);
  if (input.kind == IngestKind::height && (input.no_data || is_float(input.type))) text += fmt::format("<NODATA>{}</NODATA>", input.no_data.value_or(std::numeric_limits<double>::quiet_NaN()));
  if (input.kind == IngestKind::picture && (input.alpha_band > 0 || input.has_mask)) text += "<UseMaskBand>true</UseMaskBand>";
  return text + "</ComplexSource>";
}

std::string mosaic_xml(const std::vector<Input>& inputs, const IngestOptions& options, const OutputPlan& plan) {
  std::string text = fmt::format("<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\">", plan.width, plan.height);
  for (int band = 1; band <= plan.layout.bands; ++band) {
    text += fmt::format("<VRTRasterBand dataType=\"{}\" band=\"{}\">", GDALGetDataTypeName(gdal_type(plan.layout.type)), band);
    if (plan.layout.no_data) text += fmt::format("<NoDataValue>{}</NoDataValue>", *plan.layout.no_data);
    text += fmt::format("<ColorInterp>{}</ColorInterp>", plan.bands[static_cast<std::size_t>(band) - 1].colour);
    for (const Input& input : inputs) text += source_xml(input, options, plan, band);
    text += "</VRTRasterBand>";
  }
  return text + "</VRTDataset>";
}

/// Whether a file has all that the output has, so that it needs no mosaic around it.
bool is_the_output(const std::vector<Input>& inputs, const OutputPlan& plan) {
  const Input& only = inputs.front();
  return inputs.size() == 1 && !only.warped && only.scale_to_byte == 1.0 && static_cast<int>(only.bands.size()) == plan.layout.bands && only.place.x == 0.0 && only.place.y == 0.0 &&
         only.place.width == only.columns && only.place.height == only.rows && gdal_type(plan.layout.type) == gdal_type(only.type);
}

/// What every chunk depends on.
void hash_chunks(const std::vector<Input>& inputs, const IngestOptions& options, const RepairPlan& repair, OutputPlan& plan) {
  const std::string common = fmt::format("{}|{}|GDAL {}{}", plan.description(), options.resampling, GDALVersionInfo("VERSION_NUM"), repair.description());
  plan.chunk_hashes.assign(static_cast<std::size_t>(plan.chunk_columns()) * static_cast<std::size_t>(plan.chunk_rows()), "");
  for (std::size_t i = 0; i < plan.chunk_hashes.size(); ++i) {
    const Chunk chunk = chunk_of(plan, static_cast<int>(i));
    std::string text;
    for (const Input& input : inputs) {
      // Resampling reaches beyond a pixel by a few of the coarser of the two grids.
      const double reach = repair.margin() + 4.0 * std::max({1.0, input.place.width / input.columns, input.place.height / input.rows});
      const Rectangle& place = input.place;
      const bool touches = place.x - reach < chunk.x + chunk.width && chunk.x < place.x + place.width + reach && place.y - reach < chunk.y + chunk.height && chunk.y < place.y + place.height + reach;
      if (touches) text += fmt::format("|{} {} {} {} {} {}", input.revision, place.x, place.y, place.width, place.height, input.warped ? source::wkt_of(input.crs) : "");
    }
    if (!text.empty()) plan.chunk_hashes[i] = fmt::format("{:016x}{:016x}", fnv1a(common + text), fnv1a(fmt::format("{}{}{}", chunk.x, text, chunk.y)));
  }
}

/// The longest rows that are stored as one; 0 if there are none.
int stored_row_pixels(const std::vector<Input>& inputs) {
  int longest = 0;
  for (const Input& input : inputs) {
    if (input.block_x == input.columns) longest = std::max(longest, input.block_x);
  }
  return longest;
}

}  // namespace

Result<Mosaic> Mosaic::create(const IngestOptions& options) {
  Result<std::vector<std::string>> paths = list_inputs(options);
  if (!paths) return paths.error();
  auto files = std::make_shared<MemoryFiles>();
  std::vector<Input> inputs;
  for (const std::string& path : *paths) {
    Result<Input> input = inspect(path, options, *files);
    if (!input) return input.error();
    inputs.push_back(std::move(*input));
  }
  Result<OGRSpatialReference> crs = target_crs(options, inputs);
  if (!crs) return crs.error();
  for (Input& input : inputs) input.warped = !input.north_up || !same_crs(input.crs, *crs) || (input.kind == IngestKind::picture && input.no_data);
  Mosaic mosaic;
  OutputPlan& plan = mosaic.plan_;
  plan.crs = source::wkt_of(*crs);
  plan.block = options.block;
  plan.point_samples = std::all_of(inputs.begin(), inputs.end(), [](const Input& input) { return input.point_samples; });
  if (Result<void> chosen = choose_grid(options, inputs, plan, plan.crs); !chosen) return chosen.error();
  if (Result<void> chosen = choose_samples(inputs, plan); !chosen) return chosen.error();
  if (Result<void> chosen = choose_codec(options, inputs, plan); !chosen) return chosen.error();
  choose_chunks(plan, stored_row_pixels(inputs));
  // Finer ones over coarser ones; of one fineness the later over the earlier.
  const auto fineness = [](const Input& input) { return input.place.width * input.place.height / (static_cast<double>(input.columns) * input.rows); };
  std::stable_sort(inputs.begin(), inputs.end(), [&](const Input& a, const Input& b) { return fineness(a) > fineness(b) * 1.01; });
  const OutputPlan before = plan;
  OGRSpatialReference declared = *crs;
  if (Result<void> put = declare_vertical(options, declared); !put) return put.error();
  plan.crs = source::wkt_of(declared);
  Result<RepairPlan> repair = RepairPlan::create(options.repair, inputs.front().kind, plan);
  if (!repair) return repair.error();
  mosaic.repair_ = std::move(*repair);
  hash_chunks(inputs, options, mosaic.repair_, plan);
  for (Input& input : inputs) {
    if (!input.warped) continue;
    if (Result<void> warped = warp(input, options, before, *files); !warped) return warped.error();
  }
  if (is_the_output(inputs, plan)) {
    mosaic.name_ = inputs.front().source;
  } else {
    mosaic.name_ = files->add();
    const std::string xml = mosaic_xml(inputs, options, plan);
    VSILFILE* file = VSIFOpenL(mosaic.name_.c_str(), "wb");
    const bool written = file != nullptr && VSIFWriteL(xml.data(), 1, xml.size(), file) == xml.size();
    if (file != nullptr) VSIFCloseL(file);
    if (!written) return {ErrorCode::exhausted, "there is no memory for the list of inputs"};
  }
  mosaic.files_ = files;
  return mosaic;
}

Result<GDALDatasetUniquePtr> Mosaic::open() const { return source::open_dataset(name_); }

Result<Samples> read_window(GDALDataset& mosaic, const SampleLayout& layout, int x, int y, int width, int height) {
  Samples samples = make_samples(layout, width, height);
  const source::QuietErrors quiet;
  const auto pixel = static_cast<GSpacing>(layout.pixel_bytes());
  const CPLErr read = mosaic.RasterIO(GF_Read, x, y, width, height, samples.bytes.data(), width, height, gdal_type(layout.type), layout.bands, nullptr, pixel, pixel * width,
                                      static_cast<GSpacing>(bytes_of(layout.type)), nullptr);
  const bool outside = quiet.last().starts_with("PROJ");  // of a warped input: places that its CRS does not have
  if (read != CE_None || !(quiet.last().empty() || outside)) {
    return {ErrorCode::corrupt, fmt::format("an input cannot be read: {}; is it whole? What is done is kept: the same command goes on from there", quiet.last())};
  }
  clean(layout, samples);
  return samples;
}

}  // namespace tellurion::prepare
