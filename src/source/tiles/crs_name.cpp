#include "source/tiles/crs_name.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>
#include <vector>

namespace tellurion::source {
namespace {

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return out;
}

/// The parts between any of `joints`, empty ones left out.
std::vector<std::string_view> parts_of(std::string_view text, std::string_view joints) {
  std::vector<std::string_view> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(joints), text.size());
    if (end > 0) parts.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

constexpr std::string_view kUrns[] = {"URN:OGC:DEF:CRS:", "URN:X-OGC:DEF:CRS:"};
constexpr std::string_view kUrls[] = {"HTTP://WWW.OPENGIS.NET/DEF/CRS/", "HTTPS://WWW.OPENGIS.NET/DEF/CRS/"};
constexpr std::string_view kOldUrls[] = {"HTTP://WWW.OPENGIS.NET/GML/SRS/"};  // ".../epsg.xml#4326"

template <std::size_t N>
std::string_view after_any(std::string_view text, const std::string_view (&starts)[N]) {
  for (const std::string_view start : starts) {
    if (text.starts_with(start)) return text.substr(start.size());
  }
  return {};
}

std::string joined(std::string authority, std::string code) {
  if (authority == "CRS") authority = "OGC", code = "CRS" + code;
  if (authority == "OGC" && (code == "84" || code == "CRS84")) return "OGC:CRS84";
  if (authority == "IAU2000") authority = "IAU_2015";  // the same codes
  // Names of Web Mercator from before it had a code.
  for (const char* alias : {"EPSG:900913", "EPSG:3785", "EPSG:102100", "EPSG:102113", "ESRI:102100", "ESRI:102113", "OSGEO:41001"}) {
    if (authority + ":" + code == alias) return "EPSG:3857";
  }
  return authority + ":" + code;
}

}  // namespace

std::string crs_name(std::string_view written) {
  const std::string all = upper(written);
  std::vector<std::string_view> parts;
  if (const std::string_view urn = after_any(all, kUrns); !urn.empty()) parts = parts_of(urn, ":");
  else if (const std::string_view url = after_any(all, kUrls); !url.empty()) parts = parts_of(url, "/");
  else if (const std::string_view old = after_any(all, kOldUrls); !old.empty()) parts = parts_of(old.substr(0, old.find(".XML")), "#"), parts.push_back(std::string_view(all).substr(all.find('#') + 1));
  else if (all.find_first_of("[+ ") == std::string::npos) parts = parts_of(all, ":");
  if (parts.size() < 2) return std::string(written);
  return joined(std::string(parts.front()), std::string(parts.back()));  // between them a version may stand
}

}  // namespace tellurion::source
