// What the readers of lists share: a list's bounds, its paths, and rings from outlines in the list's own coordinates.
// Thread-safe apart from ListMaker, which belongs to one thread.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "base/result.h"
#include "geo/geodetic.h"
#include "source/catalogue/listing.h"

namespace tellurion::source {

/// Collects a list: kMostListed rasters at most, and the first kMostProblems sentences on what was left out.
class ListMaker {
 public:
  explicit ListMaker(std::string name) : name_(std::move(name)) {}

  static constexpr std::size_t kMostProblems = 100;

  /// False once there are too many, which finish() then tells.
  bool add(ListedRaster raster);
  void leave_out(std::string problem);
  std::size_t size() const { return list_.rasters.size(); }

  /// The list, and how many more problems there were. Errors: exhausted, naming the list.
  Result<RasterList> finish() &&;

 private:
  std::string name_;
  RasterList list_;
  std::size_t unsaid_ = 0;  ///< problems
  bool full_ = false;
};

/// `written`, as a list in `folder` names a raster, as a path or URL of its own: absolute and lexically normal. URLs, names of GDAL's
/// virtual files ("/vsizip/...") and of parts of files ("NETCDF:...") stay as they are; "/vsicurl/URL" becomes the URL.
std::string listed_path(std::string_view written, const std::filesystem::path& folder);

/// `text` on one line and not too long, for a sentence on a problem.
std::string in_quotes(std::string_view text);

/// Corners of a polygon, each once; first coordinate to the east.
using Outline = std::vector<glm::dvec2>;

/// Larger outlines are replaced by the rectangle round them.
inline constexpr std::size_t kMostCorners = 256;

/// The outline with each edge cut into `steps`.
std::vector<glm::dvec2> densified(std::span<const glm::dvec2> outline, int steps);

/// The rectangle from `lower` to `upper` as a ring.
std::vector<glm::dvec2> ring_of_rectangle(glm::dvec2 lower, glm::dvec2 upper);

/// One ring, bending at even places only, round all `outlines`: of a single one its own. `period`: by how much the first coordinate grows
/// round the body, if it does. Empty if there is none: too few corners, a coordinate that is no number, or an edge of more than half a
/// turn, which does not tell whether it goes that way or crosses the antimeridian.
std::vector<glm::dvec2> ring_of_outlines(std::vector<Outline> outlines, std::optional<double> period);

/// Adds whole turns to longitudes, so that no place lies more than half a turn from the one before.
void join_longitudes(std::span<geo::LatLon> ring);

}  // namespace tellurion::source
