#include "prepare/gdal/inputs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <system_error>
#include <utility>

#include <cpl_conv.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include "base/hash.h"
#include "prepare/gdal/gdal_types.h"
#include "prepare/gdal/input.h"
#include "prepare/gdal/memory_files.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

constexpr double kPixelTolerance = 1e-3;  ///< pixels: grids that differ by less are the same

// --- The inputs ------------------------------------------------------------------------------------------------------

Result<OGRSpatialReference> crs_from(const std::string& text, const char* option) {
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(text.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) != OGRERR_NONE || crs.IsEmpty()) {
    return {ErrorCode::invalid_argument, fmt::format("PROJ does not know {} \"{}\"; write a code like EPSG:4326, a PROJ string or WKT", option, text)};
  }
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return crs;
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

void choose_height_samples(const std::vector<Input>& inputs, bool has_voids, OutputPlan& plan) {
  SampleLayout& layout = plan.layout;
  for (const Input& input : inputs) {
    if (!layout.no_data && input.no_data && holds(layout.type, *input.no_data)) layout.no_data = input.no_data;
  }
  if (layout.no_data || !has_voids) return;
  if (layout.type == SampleType::u8) layout.type = SampleType::i16;
  if (layout.type == SampleType::u16) layout.type = SampleType::i32;
  if (layout.type == SampleType::u32) layout.type = SampleType::f64;
  layout.no_data = kOwnVoid;
}

Result<void> choose_samples(const std::vector<Input>& inputs, const IngestOptions& options, OutputPlan& plan) {
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
  const bool has_voids = !options.repair.coasts.empty() || !cover_all(inputs, plan);
  if (first.kind == IngestKind::height) {
    choose_height_samples(inputs, has_voids, plan);
  } else {
    if (inputs.size() > 1 && first.type != layout.type) return unsupported(first, "and other pictures have samples of different depth; bring them to one first: gdal_translate -ot Byte -scale");
    layout.alpha = transparent || has_voids;
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
    if (!text.empty() || repair.base() != nullptr) plan.chunk_hashes[i] = fmt::format("{:016x}{:016x}", fnv1a(common + text), fnv1a(fmt::format("{}{}{}", chunk.x, text, chunk.y)));
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
  if (Result<void> chosen = choose_samples(inputs, options, plan); !chosen) return chosen.error();
  if (Result<void> chosen = choose_codec(options, inputs, plan); !chosen) return chosen.error();
  choose_chunks(plan, options.repair.any() ? 0 : stored_row_pixels(inputs));  // wide ones cost memory for margins
  // Finer ones over coarser ones; of one fineness the later over the earlier.
  const auto fineness = [](const Input& input) { return input.place.width * input.place.height / (static_cast<double>(input.columns) * input.rows); };
  std::stable_sort(inputs.begin(), inputs.end(), [&](const Input& a, const Input& b) { return fineness(a) > fineness(b) * 1.01; });
  const OutputPlan before = plan;
  OGRSpatialReference declared = *crs;
  if (Result<void> put = declare_vertical(options, declared); !put) return put.error();
  plan.crs = source::wkt_of(declared);
  Result<RepairPlan> repair = RepairPlan::create(options, inputs.front().kind, before);
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
