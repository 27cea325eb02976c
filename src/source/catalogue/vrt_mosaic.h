// GDAL's virtual rasters as lists: the files that one is put together from, and where they lie in it.
// Thread-safe: pure functions.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"

namespace tellurion::source {

struct VrtPart {
  std::string path;
  glm::dvec2 lower{0.0};      ///< its rectangle in the mosaic's pixels; of several rectangles of a file, the one round them
  glm::dvec2 upper{0.0};
  glm::dvec2 reduction{0.0};  ///< of its pixels, in each of the mosaic's; 0: not told
};

struct VrtMosaic {
  std::string crs;            ///< WKT or what else the file says; empty: nothing
  std::optional<std::array<double, 6>> transform;  ///< as GDAL has it
  int width = 0;
  int height = 0;
  std::vector<VrtPart> parts;          ///< each file once, in the file's order
  std::vector<std::string> problems;   ///< sentences on sources that were left out
};

/// Reads a VRT `name` in `folder`; relative paths that are not said to be relative to the VRT count from the working folder. Errors,
/// naming the VRT: corrupt; exhausted (too many files, or too large); unsupported (its pixels are made otherwise than by putting files
/// side by side: warped, derived, pan-sharpened; or it has no sources).
/// Never looks at the files.
Result<VrtMosaic> parse_vrt(std::string_view text, const std::filesystem::path& folder, const std::string& name);

}  // namespace tellurion::source
