#include "source/catalogue/list_maker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "source/catalogue/footprint.h"

namespace tellurion::source {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kFewCorners = 16;  ///< each edge of such an outline is cut as finely as that of a raster

struct Rectangle {
  glm::dvec2 lower{kInfinity};
  glm::dvec2 upper{-kInfinity};

  void add(const Rectangle& other) {
    lower = glm::min(lower, other.lower);
    upper = glm::max(upper, other.upper);
  }
  double width() const { return upper.x - lower.x; }
};

Rectangle rectangle_of(const Outline& outline) {
  Rectangle r;
  for (const glm::dvec2& corner : outline) r.add({corner, corner});
  return r;
}

/// Round all; with a period, parts are moved round the body where that makes it narrower: those beside the antimeridian lie together.
Rectangle rectangle_of(const std::vector<Outline>& outlines, std::optional<double> period) {
  Rectangle all;
  for (const Outline& outline : outlines) all.add(rectangle_of(outline));
  if (!period) return all;
  const double middle = (all.lower.x + all.upper.x) / 2.0;
  Rectangle moved;
  for (const Outline& outline : outlines) {
    Rectangle part = rectangle_of(outline);
    const double by = part.lower.x + part.upper.x < 2.0 * middle ? *period : 0.0;
    part.lower.x += by;
    part.upper.x += by;
    moved.add(part);
  }
  return moved.width() < all.width() ? moved : all;
}

/// Whether the outline says which way its edges go. One of a whole turn does.
bool is_plain(const Outline& outline, std::optional<double> period) {
  constexpr double kRounding = 1e-9;
  if (!period) return true;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const double step = std::abs(outline[i].x - outline[j].x);
    if (step > *period / 2.0 && std::abs(step - *period) > kRounding * *period) return false;
  }
  return true;
}

}  // namespace

bool ListMaker::add(ListedRaster raster) {
  full_ = full_ || list_.rasters.size() >= kMostListed;
  if (!full_) list_.rasters.push_back(std::move(raster));
  return !full_;
}

void ListMaker::leave_out(std::string problem) {
  if (list_.problems.size() < kMostProblems) list_.problems.push_back(std::move(problem));
  else ++unsaid_;
}

Result<RasterList> ListMaker::finish() && {
  if (full_) return Error{ErrorCode::exhausted, fmt::format("{}: lists more than {} rasters; split it into several lists", name_, kMostListed)};
  if (unsaid_ > 0) list_.problems.push_back(fmt::format("{}: {} more entries were left out.", name_, unsaid_));
  return std::move(list_);
}

std::string listed_path(std::string_view written, const std::filesystem::path& folder) {
  constexpr std::string_view kRemote = "/vsicurl/";
  if (written.starts_with(kRemote) && written.substr(kRemote.size()).starts_with("http")) return std::string(written.substr(kRemote.size()));
  if (written.starts_with("/vsi") || written.find("://") != std::string_view::npos) return std::string(written);
  const std::size_t prefix = written.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_");
  if (prefix != std::string_view::npos && prefix > 1 && written[prefix] == ':') return std::string(written);
  return (folder / std::filesystem::path(written)).lexically_normal().string();
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kMost = 120;
  std::string line = "\"";
  for (const char c : text.substr(0, kMost)) line += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '.' : c;
  return line + (text.size() > kMost ? "...\"" : "\"");
}

std::vector<glm::dvec2> densified(std::span<const glm::dvec2> outline, int steps) {
  std::vector<glm::dvec2> ring;
  ring.reserve(outline.size() * static_cast<std::size_t>(steps));
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const glm::dvec2& next = outline[(i + 1) % outline.size()];
    for (int step = 0; step < steps; ++step) ring.push_back(glm::mix(outline[i], next, static_cast<double>(step) / steps));
  }
  return ring;
}

std::vector<glm::dvec2> ring_of_rectangle(glm::dvec2 lower, glm::dvec2 upper) {
  const Outline corners{{lower.x, upper.y}, upper, {upper.x, lower.y}, lower};
  return densified(corners, kRingSteps);
}

std::vector<glm::dvec2> ring_of_outlines(std::vector<Outline> outlines, std::optional<double> period) {
  for (Outline& outline : outlines) {
    const bool finite = std::ranges::all_of(outline, [](const glm::dvec2& c) { return std::isfinite(c.x) && std::isfinite(c.y); });
    if (!finite) return {};
    outline.erase(std::unique(outline.begin(), outline.end()), outline.end());
    while (outline.size() > 1 && outline.front() == outline.back()) outline.pop_back();
    if (outline.size() < 3 || !is_plain(outline, period)) return {};
  }
  if (outlines.empty()) return {};
  if (outlines.size() == 1 && outlines.front().size() <= kMostCorners) return densified(outlines.front(), outlines.front().size() <= kFewCorners ? kRingSteps : 2);
  const Rectangle all = rectangle_of(outlines, period);
  return ring_of_rectangle(all.lower, all.upper);
}

void join_longitudes(std::span<geo::LatLon> ring) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (std::size_t i = 1; i < ring.size(); ++i) {
    const double step = ring[i].longitude.value - ring[i - 1].longitude.value;
    ring[i].longitude.value -= kTurn * std::round(step / kTurn);
  }
}

}  // namespace tellurion::source
