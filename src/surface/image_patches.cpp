#include "surface/image_patches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>

#include <glm/common.hpp>

#include "surface/control_grid.h"

namespace tellurion::surface {
namespace {

/// The sides of a raster on which it ends in a point, a pole of its projection: nothing lies beyond them.
struct ClosedSides {
  bool top = false;
  bool bottom = false;
};

ClosedSides closed_sides(const source::RasterDescription& raster, source::RasterReader& reader) {
  const source::LevelSize& size = raster.levels.front();
  const auto is_pole = [&](double y) {
    const std::array<glm::dvec2, 2> pixels{glm::dvec2(0.25 * size.width, y), glm::dvec2(0.75 * size.width, y)};
    std::array<geo::LatLon, 2> places;
    reader.to_places(pixels, places);
    const double step = raster.spacing.value / raster.ellipsoid.b();
    return std::all_of(places.begin(), places.end(),
                       [&](const geo::LatLon& p) { return std::cos(p.latitude.value) < 0.5 * step; });
  };
  return {is_pole(0.0), is_pole(size.height)};
}

/// A window of a level, to be reduced by whole factors on each axis after reading.
struct WindowChoice {
  int level = 0;
  source::PixelWindow window;
  glm::ivec2 reduction{1};
};

int power_of_two_within(double ratio) {
  int factor = 1;
  while (2 * factor <= ratio && factor < (1 << 20)) factor *= 2;
  return factor;
}

/// The coarsest level that keeps a pixel a texel on the axis that has fewest; the other axis is reduced by whole factors.
/// Nothing if the grid lies beside the raster after all.
std::optional<WindowChoice> choose_window(const source::RasterDescription& raster, const ControlGrid& grid) {
  constexpr double kLargestRead = 4096.0 * 4096.0;  // pixels, before reduction
  glm::dvec2 low(INFINITY), high(-INFINITY);
  for (const glm::dvec2& pixel : grid.pixels) {
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  if (!raster.wraps) {
    low.x = std::max(low.x, -2.0);
    high.x = std::min(high.x, raster.levels.front().width + 2.0);
  }
  low.y = std::max(low.y, -2.0);
  high.y = std::min(high.y, raster.levels.front().height + 2.0);

  if (low.x >= high.x || low.y >= high.y) return std::nullopt;

  const int last = static_cast<int>(raster.levels.size()) - 1;
  WindowChoice choice;
  for (;; ++choice.level) {
    const glm::dvec2 scale = source::level_scale(raster, choice.level);
    const glm::dvec2 per_texel = grid.pixels_per_texel * scale;
    const glm::dvec2 size = (high - low) * scale + 4.0;
    if (choice.level < last && (std::min(per_texel.x, per_texel.y) >= 2.0 || size.x * size.y > kLargestRead)) continue;
    choice.reduction = {power_of_two_within(std::max(per_texel.x, size.x / (kLargestWindow / 2))),
                        power_of_two_within(std::max(per_texel.y, size.y / (kLargestWindow / 2)))};
    // One pixel, after reduction, round all that is sampled.
    const glm::ivec2 first = glm::ivec2(glm::floor(low * scale - 0.5)) - choice.reduction + 1;
    const glm::ivec2 end = glm::ivec2(glm::ceil(high * scale + 0.5)) + choice.reduction - 1;
    const glm::ivec2 pixels = (end - first + choice.reduction - 1) / choice.reduction * choice.reduction;
    choice.window = {first.x, first.y, pixels.x, pixels.y};
    return choice;
  }
}

/// Means of factor.x x factor.y pixels.
raster::Image reduced(const raster::Image& image, glm::ivec2 factor) {
  if (factor == glm::ivec2(1)) return image;
  raster::Image out{image.width / factor.x, image.height / factor.y, {}};
  out.rgba.reserve(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 4);
  const auto count = static_cast<unsigned>(factor.x * factor.y);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      std::array<unsigned, 4> sum{};
      for (int row = 0; row < factor.y; ++row) {
        const std::size_t start = image.offset(x * factor.x, y * factor.y + row);
        for (std::size_t i = 0; i < static_cast<std::size_t>(factor.x) * 4; ++i) sum[i & 3] += image.rgba[start + i];
      }
      for (const unsigned channel : sum) out.rgba.push_back(static_cast<std::uint8_t>((channel + count / 2) / count));
    }
  }
  return out;
}

/// Makes transparent what lies beyond the raster's borders, except where nothing can lie there.
void clear_outside(raster::Image& image, const source::PixelWindow& window, const source::LevelSize& size, bool wraps,
                   const ClosedSides& closed) {
  for (int j = 0; j < window.height; ++j) {
    const int y = window.y + j;
    const bool row_outside = (y < 0 && !closed.top) || (y >= size.height && !closed.bottom);
    const auto row = image.rgba.begin() + static_cast<std::ptrdiff_t>(image.offset(0, j));
    const auto clear = [&](int from, int to) {
      if (from < to) std::fill(row + 4 * from, row + 4 * to, std::uint8_t{0});
    };
    if (row_outside) {
      clear(0, window.width);
    } else if (!wraps) {
      clear(0, std::clamp(-window.x, 0, window.width));
      clear(std::clamp(size.width - window.x, 0, window.width), window.width);
    }
  }
}

bool is_opaque(const raster::Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] != 255) return false;
  }
  return true;
}

/// A patch without an image if there is nothing to show.
Result<ImagePatch> make_patch(cache::CachedRaster& raster, const ControlGrid& grid, const ClosedSides& closed) {
  const source::RasterDescription& about = raster.description();
  ImagePatch patch;
  const std::optional<WindowChoice> found = choose_window(about, grid);
  if (!found) return patch;
  const WindowChoice& choice = *found;
  Result<raster::Image> image = raster.read_colours(choice.level, choice.window);
  if (!image) return image.error();
  clear_outside(*image, choice.window, about.levels[static_cast<std::size_t>(choice.level)], about.wraps, closed);

  patch.image = reduced(*image, choice.reduction);
  patch.opaque = is_opaque(patch.image);
  patch.columns = grid.columns;
  patch.rows = grid.rows;
  patch.lower = glm::vec2(grid.lower);
  patch.upper = glm::vec2(grid.upper);
  const glm::dvec2 scale = source::level_scale(about, choice.level);
  const glm::dvec2 first(choice.window.x, choice.window.y);
  const glm::dvec2 size(choice.window.width, choice.window.height);
  patch.image_points.reserve(grid.pixels.size());
  for (const glm::dvec2& pixel : grid.pixels) patch.image_points.emplace_back((pixel * scale - first) / size);
  return patch;
}

}  // namespace

Result<ColourModel> ColourModel::open(std::shared_ptr<const SurfaceDescription> description, cache::BlockCache& cache) {
  ColourModel model;
  for (const Layer& layer : description->colours) {
    if (!layer.enabled) continue;
    Result<cache::CachedRaster> raster = cache::CachedRaster::open(*layer.source, cache, layer.source_id);
    if (!raster) return raster.error();
    model.layers_.push_back({&layer, std::move(raster).value()});
  }
  model.description_ = std::move(description);
  return model;
}

Result<TileImagery> build_imagery(ColourModel& model, const geo::TileKey& key, std::stop_token stop) {
  std::vector<ImagePatch> from_the_top;
  for (auto layer = model.layers_.rbegin(); layer != model.layers_.rend(); ++layer) {
    const Layer& settings = *layer->settings;
    if (!settings.source->coverage().touches(key)) continue;
    source::RasterReader& reader = layer->raster.reader();
    const SlotMapping mapping = map_slot(model.description().ellipsoid, key, layer->raster.description(), reader);
    const ClosedSides closed = closed_sides(layer->raster.description(), reader);
    bool hides_all_below = mapping.whole;
    for (const ControlGrid& grid : mapping.grids) {
      if (stop.stop_requested()) return Error{ErrorCode::cancelled, "imagery of " + geo::to_string(key)};
      Result<ImagePatch> patch = make_patch(layer->raster, grid, closed);
      if (!patch) return patch.error();
      if (patch->image.rgba.empty()) continue;
      patch->opacity = settings.opacity;
      patch->gamma = settings.gamma;
      patch->multiplier = settings.multiplier;
      patch->opaque = patch->opaque && settings.opacity >= 1.0f;
      hides_all_below = hides_all_below && patch->opaque;
      from_the_top.push_back(std::move(patch).value());
    }
    if (hides_all_below) break;
  }
  TileImagery imagery;
  imagery.patches.assign(std::make_move_iterator(from_the_top.rbegin()), std::make_move_iterator(from_the_top.rend()));
  return imagery;
}

}  // namespace tellurion::surface
