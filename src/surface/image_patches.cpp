#include "surface/image_patches.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <span>
#include <utility>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "surface/control_grid.h"
#include "surface/error_scan.h"
#include "surface/feather.h"
#include "surface/tile_grid.h"

namespace tellurion::surface {
namespace {

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

/// The coarsest level that keeps a pixel a texel on the axis that has fewest, the other axis to be reduced by whole factors;
/// the window holds all `pixels` (of level 0). Nothing if they lie beside the raster after all.
std::optional<WindowChoice> choose_window(const source::RasterDescription& raster, std::span<const glm::dvec2> pixels,
                                          glm::dvec2 pixels_per_texel) {
  constexpr double kLargestRead = 4096.0 * 4096.0;  // pixels, before reduction
  glm::dvec2 low(INFINITY), high(-INFINITY);
  for (const glm::dvec2& pixel : pixels) {
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  if (!raster.wraps) {
    low.x = std::max(low.x, -2.0);
    high.x = std::min(high.x, raster.levels.front().width + 2.0);
  }
  low.y = std::max(low.y, -2.0);
  high.y = std::min(high.y, raster.levels.front().height + 2.0);

  if (!(low.x <= high.x && low.y <= high.y)) return std::nullopt;

  const int last = static_cast<int>(raster.levels.size()) - 1;
  WindowChoice choice;
  for (;; ++choice.level) {
    const glm::dvec2 scale = source::level_scale(raster, choice.level);
    const glm::dvec2 per_texel = pixels_per_texel * scale;
    const glm::dvec2 size = (high - low) * scale + 4.0;
    if (choice.level < last && (std::min(per_texel.x, per_texel.y) >= 2.0 || size.x * size.y > kLargestRead)) continue;
    // A raster can be much smaller than a texel.
    const glm::dvec2 wanted = glm::min(glm::max(per_texel, size / (kLargestWindow / 2.0)), size);
    choice.reduction = {power_of_two_within(wanted.x), power_of_two_within(wanted.y)};
    // One pixel, after reduction, round all that is sampled.
    const glm::ivec2 first = glm::ivec2(glm::floor(low * scale - 0.5)) - choice.reduction + 1;
    const glm::ivec2 end = glm::ivec2(glm::ceil(high * scale + 0.5)) + choice.reduction - 1;
    const glm::ivec2 whole = (end - first + choice.reduction - 1) / choice.reduction * choice.reduction;
    choice.window = {first.x, first.y, whole.x, whole.y};
    return choice;
  }
}

/// Means of factor.x x factor.y pixels; both are powers of two.
raster::Image reduced(raster::Image image, glm::ivec2 factor) {
  if (factor == glm::ivec2(1)) return image;
  raster::Image out{image.width / factor.x, image.height / factor.y, {}};
  out.rgba.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 4);
  const auto count = static_cast<unsigned>(factor.x * factor.y);
  const int shift = std::countr_zero(count);
  auto mean = out.rgba.begin();
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      std::array<unsigned, 4> sum{count / 2, count / 2, count / 2, count / 2};
      for (int row = 0; row < factor.y; ++row) {
        const std::uint8_t* pixel = &image.rgba[image.offset(x * factor.x, y * factor.y + row)];
        for (int i = 0; i < factor.x; ++i, pixel += 4) {
          for (std::size_t c = 0; c < 4; ++c) sum[c] += pixel[c];
        }
      }
      for (const unsigned channel : sum) *mean++ = static_cast<std::uint8_t>(channel >> shift);
    }
  }
  return out;
}

bool is_opaque(const raster::Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] != 255) return false;
  }
  return true;
}

/// Whether nothing of it would be seen; compression leaves dark pixels a little above black.
bool is_dark(const raster::Image& image) {
  constexpr std::uint8_t kDark = 6;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    if (std::max({image.rgba[i], image.rgba[i + 1], image.rgba[i + 2]}) > kDark) return false;
  }
  return true;
}

bool is_clear(const raster::Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] != 0) return false;
  }
  return true;
}

std::vector<ImagePatch>& list_of(ImageUse use, TileImagery& imagery) {
  switch (use) {
    case ImageUse::colour:
    case ImageUse::grayscale: return imagery.patches;
    case ImageUse::night:
    case ImageUse::water: return imagery.effects;
    case ImageUse::overlay: return imagery.overlays;
    case ImageUse::normal: break;
  }
  return imagery.normals;
}

/// Leaves out the patches of a use all of which are dark.
void drop_dark(std::vector<ImagePatch>& effects) {
  for (const ImageUse use : {ImageUse::night, ImageUse::water}) {
    const auto is_bright = [use](const ImagePatch& patch) { return patch.use == use && !is_dark(patch.image); };
    if (std::ranges::none_of(effects, is_bright)) std::erase_if(effects, [use](const ImagePatch& patch) { return patch.use == use; });
  }
}

/// Pixels of a window after reduction, with the way into them.
struct Window : ImagePlace {
  raster::Image image;
};

/// Where a raster's data end, and over how many of its pixels it fades inwards from there.
struct Edges {
  Extent extent;
  double feather = 0;
};

/// Faded near voids, not near the border. Empty if there is nothing to show.
Result<Window> read_window(cache::CachedRaster& raster, std::span<const glm::dvec2> pixels, glm::dvec2 pixels_per_texel, const Edges& edges) {
  const source::RasterDescription& about = raster.description();
  Window window;
  const std::optional<WindowChoice> choice = choose_window(about, pixels, pixels_per_texel);
  if (!choice) return window;
  const glm::dvec2 scale = source::level_scale(about, choice->level);
  window.first = glm::dvec2(choice->window.x, choice->window.y) / scale;
  window.scale = scale / glm::dvec2(choice->reduction);
  Result<raster::Image> image = raster.read_colours(choice->level, choice->window);
  Result<VoidDistances> voids = VoidDistances{};  // asked for even if the image is on its way
  if (edges.feather > 0.0) voids = find_voids(raster, choice->level, window.first, window.first + glm::dvec2(choice->window.width, choice->window.height) / scale, edges.feather);
  if (!image) return image.error();
  if (!voids) return voids.error();
  window.image = reduced(std::move(*image), choice->reduction);
  fade_from_voids(window.image, window, *voids, edges.extent, edges.feather);
  return window;
}

/// Where the source's projection is smooth: the window itself, drawn through the control points.
Result<ImagePatch> window_patch(cache::CachedRaster& raster, const ControlGrid& grid, const Edges& edges) {
  Result<Window> window = read_window(raster, grid.pixels, grid.pixels_per_texel, edges);
  if (!window) return window.error();
  ImagePatch patch;
  patch.columns = grid.columns;
  patch.rows = grid.rows;
  const glm::dvec2 size(window->image.width, window->image.height);
  patch.image_points.reserve(grid.pixels.size());
  for (const glm::dvec2& pixel : grid.pixels) {
    patch.image_points.emplace_back((pixel - window->first) * window->scale / size);
  }
  const auto limit = [&](glm::dvec2 pixel) {
    return glm::vec2(glm::clamp((pixel - window->first) * window->scale / size, -double{kUnbounded}, double{kUnbounded}));
  };
  patch.data_lower = limit(edges.extent.lower);
  patch.data_upper = limit(edges.extent.upper);
  patch.data_pixel = window->scale / size;
  patch.feather = edges.feather * window->scale / size;
  const double fades = edges.feather > 0.0 ? std::max(edges.feather, 2.0 * std::max(grid.pixels_per_texel.x, grid.pixels_per_texel.y)) : 0.0;
  patch.opaque = is_opaque(window->image) && std::ranges::all_of(grid.pixels, [&](const glm::dvec2& pixel) { return edges.extent.inside(pixel) >= fades; });
  patch.image = std::move(window->image);
  return patch;
}

/// Bilinear colour, 0 to 255 a channel; `at` is continuous, as pixel coordinates are.
std::array<float, 4> sample(const raster::Image& image, glm::dvec2 at) {
  const glm::dvec2 corner = glm::floor(at - 0.5);
  const glm::vec2 share(at - 0.5 - corner);
  std::array<float, 4> sum{};
  for (int i = 0; i < 4; ++i) {
    const int x = std::clamp(static_cast<int>(corner.x) + (i & 1), 0, image.width - 1);
    const int y = std::clamp(static_cast<int>(corner.y) + (i >> 1), 0, image.height - 1);
    const float weight = ((i & 1) != 0 ? share.x : 1.0f - share.x) * ((i >> 1) != 0 ? share.y : 1.0f - share.y);
    const std::array<std::uint8_t, 4> colour = image.at(x, y);
    for (std::size_t c = 0; c < 4; ++c) sum[c] += weight * static_cast<float>(colour[c]);
  }
  return sum;
}

/// Where it is not: the texels themselves, each the mean of kPerTexel^2 places.
Result<ImagePatch> texel_patch(cache::CachedRaster& raster, const geo::TileKey& key, const ControlGrid& grid,
                               const Edges& edges) {
  constexpr int kPerTexel = 2;
  const glm::ivec2 texels = glm::ivec2(grid.columns, grid.rows) * grid.cell_texels;
  const glm::ivec2 samples = texels * kPerTexel;
  std::vector<geo::LatLon> places;
  places.reserve(static_cast<std::size_t>(samples.x) * static_cast<std::size_t>(samples.y));
  for (int y = 0; y < samples.y; ++y) {
    for (int x = 0; x < samples.x; ++x) {
      const glm::dvec2 share = (glm::dvec2(x, y) + 0.5) / glm::dvec2(samples);
      places.push_back(geo::place_of_normal(geo::tile_normal(key, glm::mix(grid.lower, grid.upper, share))));
    }
  }
  std::vector<glm::dvec2> pixels(places.size());
  raster.reader().to_pixels(places, pixels);
  const Result<Window> window = read_window(raster, pixels, grid.pixels_per_texel, edges);
  if (!window) return window.error();

  ImagePatch patch;
  if (window->image.rgba.empty()) return patch;
  patch.columns = patch.rows = 1;
  patch.image_points = {{0.0f, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}, {1.0f, 1.0f}};
  patch.image = {texels.x, texels.y, {}};
  patch.image.rgba.reserve(static_cast<std::size_t>(texels.x) * static_cast<std::size_t>(texels.y) * 4);
  for (int row = 0; row < texels.y; ++row) {
    for (int column = 0; column < texels.x; ++column) {
      std::array<float, 4> sum{};
      for (int i = 0; i < kPerTexel * kPerTexel; ++i) {
        const int x = column * kPerTexel + i % kPerTexel, y = row * kPerTexel + i / kPerTexel;
        const glm::dvec2 pixel = pixels[static_cast<std::size_t>(y * samples.x + x)];
        const auto opacity = static_cast<float>(opacity_at(edges.extent, pixel, edges.feather));
        if (opacity == 0.0f) continue;
        const std::array<float, 4> colour = sample(window->image, (pixel - window->first) * window->scale);
        for (std::size_t c = 0; c < 4; ++c) sum[c] += opacity * colour[c];
      }
      for (const float channel : sum) {
        patch.image.rgba.push_back(static_cast<std::uint8_t>(std::lround(channel / (kPerTexel * kPerTexel))));
      }
    }
  }
  patch.opaque = is_opaque(patch.image);
  return patch;
}

/// A patch without an image if there is nothing to show.
Result<ImagePatch> make_patch(cache::CachedRaster& raster, const geo::TileKey& key, const ControlGrid& grid,
                              const Edges& edges) {
  Result<ImagePatch> patch = grid.follows ? window_patch(raster, grid, edges) : texel_patch(raster, key, grid, edges);
  if (!patch) return patch.error();
  patch->lower = glm::vec2(grid.lower);
  patch->upper = glm::vec2(grid.upper);
  return patch;
}

}  // namespace

Result<ColourModel> ColourModel::open(std::shared_ptr<const SurfaceDescription> description, cache::BlockCache& cache, ColourModel* before) {
  ColourModel model;
  model.cache_ = &cache;
  for (const Layer& layer : description->colours) {
    if (!layer.enabled) continue;
    ColourLayer& opened = model.layers_.emplace_back(ColourLayer{&layer, before ? before->take_rasters(layer) : std::list<OpenRaster>{}});
    if (layer.catalogue || !opened.rasters.empty()) continue;
    Result<cache::CachedRaster> raster = cache::CachedRaster::open(*layer.source, cache, layer.source_id, layer.content);
    if (!raster) return raster.error();
    opened.rasters.push_back({layer.source_id, layer.source, std::move(raster).value()});
  }
  model.description_ = std::move(description);
  return model;
}

std::list<ColourModel::OpenRaster> ColourModel::take_rasters(const Layer& layer) {
  const auto same = std::ranges::find_if(layers_, [&](const ColourLayer& one) {
    return one.settings->source_id == layer.source_id && one.settings->content == layer.content && one.settings->source == layer.source && !one.settings->catalogue == !layer.catalogue;
  });
  return same == layers_.end() ? std::list<OpenRaster>{} : std::exchange(same->rasters, {});
}

Result<cache::CachedRaster*> ColourModel::open_data_set(ColourLayer& layer, std::uint32_t index) {
  constexpr std::size_t kMostOpen = 64;
  const source::Catalogue& catalogue = *layer.settings->catalogue;
  const std::uint32_t id = catalogue.sets()[index]->id;
  if (const auto held = std::ranges::find(layer.rasters, id, &OpenRaster::id); held != layer.rasters.end()) {
    layer.rasters.splice(layer.rasters.begin(), layer.rasters, held);
    return &layer.rasters.front().raster;
  }
  auto source = catalogue.open(index);
  if (!source) return source.error();
  Result<cache::CachedRaster> raster = cache::CachedRaster::open(**source, *cache_, id);
  if (!raster) return raster.error();
  layer.rasters.push_front({id, std::move(*source), std::move(raster).value()});
  if (layer.rasters.size() > kMostOpen && !layer.rasters.back().raster.is_pending()) layer.rasters.pop_back();
  return &layer.rasters.front().raster;
}

bool ColourModel::take_pending(source::Awaited& awaited) {
  bool pending = false;
  for (ColourLayer& layer : layers_) {
    for (OpenRaster& open : layer.rasters) pending = open.raster.take_pending(awaited) || pending;
  }
  return pending;
}

namespace {

/// A tile's imagery while it is made, from the uppermost layer down.
class Composition {
 public:
  Composition(const SurfaceDescription& description, const geo::TileKey& key, std::stop_token stop)
      : description_(description), world_(description.ellipsoid), key_(key), stop_(std::move(stop)) {}

  bool is_hidden(ImageUse use) const { return hidden(use) || (use == ImageUse::grayscale && hidden(ImageUse::colour)); }

  /// Errors: cancelled. What cannot be read is left out, and so are normals that are no finer than those of the elevation.
  Result<void> add(const Layer& settings, std::uint32_t source_id, cache::CachedRaster& raster) {
    if (settings.use == ImageUse::normal) {
      const double spacing = std::max(raster.description().spacing.value, nominal_colour_texel(world_, key_.level));
      if (spacing >= slope_spacing()) return {};
      normals_spacing_ = normals_spacing_ > 0.0 ? std::min(normals_spacing_, spacing) : spacing;
    }
    source::RasterReader& reader = raster.reader();
    const SlotMapping mapping = map_slot(world_, key_, raster.description(), reader);
    const Edges edges{extent_of(raster.description(), reader), settings.feather};
    bool hides_all_below = mapping.whole;
    for (const ControlGrid& grid : mapping.grids) {
      if (stop_.stop_requested()) return Error{ErrorCode::cancelled, "imagery of " + geo::to_string(key_)};
      Result<ImagePatch> patch = make_patch(raster, key_, grid, edges);
      if (!patch && patch.error().code == ErrorCode::pending) {
        pending_ = true;  // taken for opaque: what lies below is asked for once it shows
        continue;
      }
      if (!patch) {
        add_missing(source_id, patch.error());
        hides_all_below = false;
        break;
      }
      if (patch->image.rgba.empty()) {
        hides_all_below = false;
        continue;
      }
      patch->opacity = settings.opacity;
      patch->gamma = settings.gamma;
      patch->multiplier = settings.multiplier;
      patch->use = settings.use;
      patch->opaque = patch->opaque && settings.opacity >= 1.0f;
      hides_all_below = hides_all_below && patch->opaque;
      from_the_top_.push_back(std::move(patch).value());
    }
    hidden_[static_cast<std::size_t>(settings.use)] = hides_all_below;
    return {};
  }

  void add_missing(std::uint32_t source_id, Error error) { missing_.push_back({source_id, std::move(error)}); }

  Result<TileImagery> finish() {
    if (pending_) return Error{ErrorCode::pending, "imagery of " + geo::to_string(key_)};
    TileImagery imagery;
    for (ImagePatch& patch : std::views::reverse(from_the_top_)) list_of(patch.use, imagery).push_back(std::move(patch));
    drop_dark(imagery.effects);
    for (auto* list : {&imagery.overlays, &imagery.normals}) std::erase_if(*list, [](const ImagePatch& patch) { return is_clear(patch.image); });
    imagery.normals_spacing = static_cast<float>(normals_spacing_);
    imagery.missing = std::move(missing_);
    return imagery;
  }

 private:
  bool hidden(ImageUse use) const { return hidden_[static_cast<std::size_t>(use)]; }

  /// Metres between the slopes that the elevation can give under the tile, at the tile's own detail.
  double slope_spacing() const {
    return std::max(finest_spacing(description_.heights, key_), nominal_slope_texel(world_, key_.level));
  }

  const SurfaceDescription& description_;
  const geo::Ellipsoid& world_;
  geo::TileKey key_;
  std::stop_token stop_;
  std::vector<ImagePatch> from_the_top_;
  std::vector<MissingLayer> missing_;
  std::array<bool, kImageUses> hidden_{};  ///< what lies further down, of each use
  double normals_spacing_ = 0.0;  ///< of the finest normals; 0: there are none
  bool pending_ = false;
};

/// The tile's slot, gutters included.
source::FaceRegion slot_region(const geo::TileKey& key) {
  const geo::FaceRect rect = geo::face_rect(key);
  const glm::dvec2 gutter = (rect.upper - rect.lower) * (static_cast<double>(kColourGutter) / (kColourSlotSide - 2 * kColourGutter));
  return source::region_of(key.face, {rect.lower - gutter, rect.upper + gutter});
}

}  // namespace

Result<TileImagery> build_imagery(ColourModel& model, const geo::TileKey& key, std::stop_token stop) {
  const geo::Ellipsoid& world = model.description().ellipsoid;
  Composition composition(model.description(), key, std::move(stop));
  const Radians narrowest(kNarrowestDataSet * nominal_colour_texel(world, key.level) / world.a());
  std::vector<std::uint32_t> found;
  for (auto layer = model.layers_.rbegin(); layer != model.layers_.rend(); ++layer) {
    const Layer& settings = *layer->settings;
    if (composition.is_hidden(settings.use) || !coverage_of(settings).touches(key)) continue;
    if (!settings.catalogue) {
      if (Result<void> added = composition.add(settings, settings.source_id, layer->rasters.front().raster); !added) return added.error();
      continue;
    }
    settings.catalogue->find(slot_region(key), narrowest, found);
    for (const std::uint32_t index : found) {
      if (composition.is_hidden(settings.use)) break;
      const Result<cache::CachedRaster*> raster = model.open_data_set(*layer, index);
      const std::uint32_t id = settings.catalogue->sets()[index]->id;
      if (!raster) {
        // What will never be there is no reason to ask for the tile again: the catalogue tells of it.
        if (raster.error().code == ErrorCode::unavailable) composition.add_missing(id, raster.error());
        continue;
      }
      if (Result<void> added = composition.add(settings, id, **raster); !added) return added.error();
    }
  }
  return composition.finish();
}

}  // namespace tellurion::surface
