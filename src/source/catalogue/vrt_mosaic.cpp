#include "source/catalogue/vrt_mosaic.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <system_error>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "base/number.h"
#include "source/catalogue/list_maker.h"
#include "source/tiles/bounded_xml.h"

namespace tellurion::source {
namespace {

constexpr std::array<std::string_view, 5> kSourceNames{"SimpleSource", "ComplexSource", "AveragedSource", "KernelFilteredSource", "NoDataFromMaskSource"};
constexpr std::string_view kMask = "MaskBand";
constexpr std::int64_t kLargestSide = std::numeric_limits<int>::max();
constexpr std::size_t kMostCrs = std::size_t{1} << 16;

/// The text without its sources, each of which is a small document of its own: a mosaic of many files would be a huge one.
struct Cut {
  std::string rest;
  std::vector<std::string_view> sources;
};

/// The name of the element that begins with `text`, which begins with <; empty if none does.
std::string_view element_name(std::string_view text) {
  const std::size_t end = text.find_first_of(" \t\r\n/>", 1);
  return end == std::string_view::npos ? std::string_view() : text.substr(1, end - 1);
}

/// The first `length` bytes of `text`, up to and with `end`; nothing if it has no end.
std::optional<std::string_view> up_to(std::string_view text, std::string_view end) {
  const std::size_t at = text.find(end);
  return at == std::string_view::npos ? std::nullopt : std::optional(text.substr(0, at + end.size()));
}

/// The whole element that `text` begins with; it holds none of its own name.
std::optional<std::string_view> whole_element(std::string_view text, std::string_view name) {
  const std::optional<std::string_view> start = up_to(text, ">");
  if (!start || start->ends_with("/>")) return start;
  return up_to(text, fmt::format("</{}>", name));
}

std::optional<Cut> cut(std::string_view text) {
  Cut made;
  while (!text.empty()) {
    const std::size_t at = std::min(text.find('<'), text.size());
    made.rest += text.substr(0, at);
    text.remove_prefix(at);
    if (text.empty()) break;
    std::optional<std::string_view> piece;
    if (text.starts_with("<!--")) {
      piece = up_to(text, "-->");
    } else if (text.starts_with("<![CDATA[")) {
      piece = up_to(text, "]]>");
      if (piece) made.rest += *piece;
    } else if (const std::string_view name = element_name(text); name == kMask) {
      piece = whole_element(text, name);
    } else if (std::ranges::find(kSourceNames, name) != kSourceNames.end()) {
      piece = whole_element(text, name);
      if (piece) made.sources.push_back(*piece);
    } else {
      piece = text.substr(0, 1);
      made.rest += '<';
    }
    if (!piece) return std::nullopt;
    text.remove_prefix(piece->size());
  }
  return made;
}

std::optional<std::array<double, 6>> read_transform(const pugi::xml_node& root) {
  std::string text = child_text(root, "GeoTransform");
  std::array<double, 6> numbers{};
  std::string_view rest = text;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t comma = rest.find(',');
    if ((comma == std::string_view::npos) != (i + 1 == numbers.size())) return std::nullopt;
    const auto number = parse_number(rest.substr(0, comma));
    if (!number) return std::nullopt;
    numbers[i] = *number;
    rest.remove_prefix(std::min(rest.size(), comma == std::string_view::npos ? rest.size() : comma + 1));
  }
  return numbers;
}

Result<void> read_header(const std::string& text, VrtMosaic& mosaic) {
  const Result<XmlDocument> document = read_xml(text);
  if (!document) return document.error();
  const pugi::xml_node root = (*document)->document_element();
  if (local_name(root) != "VRTDataset") return Error{ErrorCode::corrupt, "is no VRT: its first element is not VRTDataset"};
  const auto otherwise = [](const std::string& what) {
    return Error{ErrorCode::unsupported, fmt::format("is a VRT whose pixels are computed ({}), no list of files; name it as a raster, a source of type \"gdal\"", what)};
  };
  if (const std::string kind = attribute(root, "subClass"); !kind.empty() && kind != "VRTDataset") return otherwise(in_quotes(kind));
  for (const pugi::xml_node& band : children(root, "VRTRasterBand")) {
    if (const std::string kind = attribute(band, "subClass"); !kind.empty() && kind != "VRTRasterBand" && kind != "VRTSourcedRasterBand") return otherwise(in_quotes(kind));
  }
  const auto side = [&](const char* name) {
    const auto number = attribute_number(root, name);
    return number && *number >= 1 && *number <= static_cast<double>(kLargestSide) && *number == std::floor(*number) ? static_cast<int>(*number) : 0;
  };
  mosaic.width = side("rasterXSize");
  mosaic.height = side("rasterYSize");
  if (mosaic.width == 0 || mosaic.height == 0) return Error{ErrorCode::corrupt, "is a VRT without a size: rasterXSize and rasterYSize are no counts of pixels"};
  mosaic.crs = child(root, "SRS").text().get();
  if (mosaic.crs.size() > kMostCrs) return Error{ErrorCode::corrupt, "is a VRT whose SRS is too long"};
  mosaic.transform = read_transform(root);
  return {};
}

struct Rectangle {
  glm::dvec2 lower;
  glm::dvec2 size;
};

/// Nothing if it is not there; an empty one if it is wrong.
std::optional<Rectangle> read_rectangle(const pugi::xml_node& source, const char* name) {
  const pugi::xml_node node = child(source, name);
  if (!node) return std::nullopt;
  const auto x = attribute_number(node, "xOff"), y = attribute_number(node, "yOff"), width = attribute_number(node, "xSize"), height = attribute_number(node, "ySize");
  constexpr double kLargest = 1e12, kSmallest = 1e-6;
  const auto fits = [](const auto& number) { return number && std::abs(*number) <= kLargest; };
  if (!fits(x) || !fits(y) || !fits(width) || !fits(height) || *width < kSmallest || *height < kSmallest) return Rectangle{};
  return Rectangle{{*x, *y}, {*width, *height}};
}

bool is_wrong(const std::optional<Rectangle>& r) { return r && r->size.x <= 0.0; }

/// The part, or what is wrong with the source.
Result<VrtPart> read_part(std::string_view text, const VrtMosaic& mosaic, const std::filesystem::path& folder) {
  const auto wrong = [](std::string what) { return Error{ErrorCode::corrupt, std::move(what)}; };
  const Result<XmlDocument> document = read_xml(text);
  if (!document) return wrong("a source " + document.error().message);
  const pugi::xml_node source = (*document)->document_element();
  const pugi::xml_node named = child(source, "SourceFilename");
  const std::string written = text_of(named);
  if (written.empty()) return wrong("a source names no file");
  std::string relative = attribute(named, "relativeToVRT");
  if (relative.empty()) relative = attribute(named, "relativetoVRT");  // as older versions write it
  std::error_code failure;
  VrtPart part;
  part.path = listed_path(written, relative == "1" ? folder : std::filesystem::current_path(failure));  // as GDAL has it
  if (relative == "1" && !part.path.starts_with('/') && written == part.path && written.find("://") == std::string::npos) {
    // A part of a file: the file's name is relative, between the first colon and the last or in quotes. GDAL alone knows which.
    return wrong(fmt::format("{} names a part of a file by a relative path, which is not read", in_quotes(written)));
  }
  std::optional<Rectangle> from = read_rectangle(source, "SrcRect");
  const std::optional<Rectangle> to = read_rectangle(source, "DstRect");
  if (is_wrong(from) || is_wrong(to)) return wrong(fmt::format("the place of {} in it is no rectangle", in_quotes(written)));
  if (!from) {
    const pugi::xml_node facts = child(source, "SourceProperties");
    const auto width = attribute_number(facts, "RasterXSize"), height = attribute_number(facts, "RasterYSize");
    if (width && height && *width >= 1 && *height >= 1) from = Rectangle{{0.0, 0.0}, {*width, *height}};
  }
  const Rectangle placed = to.value_or(Rectangle{{0.0, 0.0}, {mosaic.width, mosaic.height}});
  part.lower = placed.lower;
  part.upper = placed.lower + placed.size;
  if (from) part.reduction = from->size / placed.size;
  return part;
}

}  // namespace

Result<VrtMosaic> parse_vrt(std::string_view text, const std::filesystem::path& folder, const std::string& name) {
  const auto named = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", name, error.message)}; };
  const std::optional<Cut> pieces = cut(text);
  if (!pieces) return named({ErrorCode::corrupt, "is no valid XML: an element or comment does not end"});
  VrtMosaic mosaic;
  if (const Result<void> read = read_header(pieces->rest, mosaic); !read) return named(read.error());
  if (pieces->sources.empty()) return named({ErrorCode::unsupported, "is a VRT without sources, no list of files; name it as a raster, a source of type \"gdal\""});
  std::unordered_map<std::string, std::size_t> places;  // in `parts`
  std::size_t unsaid = 0;
  for (const std::string_view source : pieces->sources) {
    Result<VrtPart> part = read_part(source, mosaic, folder);
    if (!part) {
      if (mosaic.problems.size() < ListMaker::kMostProblems) mosaic.problems.push_back(fmt::format("{}: {}.", name, part.error().message));
      else ++unsaid;
      continue;
    }
    const auto [found, is_new] = places.try_emplace(part->path, mosaic.parts.size());
    if (is_new) {
      if (mosaic.parts.size() == kMostListed) return named({ErrorCode::exhausted, fmt::format("lists more than {} rasters; split it into several lists", kMostListed)});
      mosaic.parts.push_back(std::move(*part));
      continue;
    }
    VrtPart& before = mosaic.parts[found->second];
    before.lower = glm::min(before.lower, part->lower);
    before.upper = glm::max(before.upper, part->upper);
    before.reduction = glm::max(before.reduction, part->reduction);
  }
  if (unsaid > 0) mosaic.problems.push_back(fmt::format("{}: {} more sources were left out.", name, unsaid));
  return mosaic;
}

}  // namespace tellurion::source
