#include "surface/elevation_model.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <ranges>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "surface/lattice_pixels.h"

namespace tellurion::surface {
namespace {

constexpr double kPi = std::numbers::pi;
/// All that is kept between the steps of the work stays in the processor's cache.
constexpr std::size_t kPlacesAtOnce = 4096;

/// The raster's bounds and the pixel round them across which its coverage falls to 0, with a pixel to spare.
geo::GeodeticBounds reach_of(const source::RasterDescription& raster) {
  const double margin = 2.0 * raster.spacing.value / raster.ellipsoid.b();
  geo::GeodeticBounds reach = raster.bounds;
  reach.south.value -= margin;
  reach.north.value += margin;
  const double widest_latitude = std::max(std::abs(reach.south.value), std::abs(reach.north.value));
  const double cosine = std::cos(std::min(widest_latitude, kPi / 2));
  const double sideways = cosine > margin ? margin / cosine : kPi;
  reach.west.value -= sideways;
  reach.east.value += sideways;
  return reach;
}

bool holds(const geo::GeodeticBounds& bounds, const geo::LatLon& place) {
  if (place.latitude < bounds.south || place.latitude > bounds.north) return false;
  double east_of_west = place.longitude.value - bounds.west.value;
  east_of_west -= 2.0 * kPi * std::floor(east_of_west / (2.0 * kPi));
  return east_of_west <= bounds.east.value - bounds.west.value;
}

double spacing_of_level(const source::RasterDescription& raster, int level) {
  return std::ldexp(raster.spacing.value, level);
}

/// The step in which voids are filled from levels of such a spacing (metres): one for every octave.
int step_of(double spacing) { return std::ilogb(spacing); }

void compose_one(double& below, const cache::HeightSample& sample, bool adds) {
  below += sample.coverage * (adds ? sample.metres : sample.metres - below);
}

/// Lays `lower` under what there is.
void lay_under(cache::HeightSample& upper, const cache::HeightSample& lower, double whole = 1.0) {
  const double added = (whole - upper.coverage) * lower.coverage;
  if (added <= 0.0) return;
  const double coverage = upper.coverage + added;
  upper.metres += (lower.metres - upper.metres) * (added / coverage);
  upper.coverage = lower.coverage >= 1.0 ? whole : coverage;
}

bool is_finite(const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// How much of a raster's coverage its layer's feather leaves at a pixel.
double opacity_of(const Layer& layer, const Extent& extent, const glm::dvec2& pixel) { return layer.feather > 0.0 ? opacity_at(extent, pixel, layer.feather) : 1.0; }

/// Pixels of a level per pixel of level 0; each level after the raster's last halves them (see CoarseHeights).
glm::dvec2 scale_of_level(const source::RasterDescription& raster, int level) {
  const int last = static_cast<int>(raster.levels.size()) - 1;
  return source::level_scale(raster, std::min(level, last)) * std::ldexp(1.0, std::min(last - level, 0));
}

/// The place within the raster nearest to a pixel, and the share of a level's coverage that is left there.
struct WithinRaster {
  glm::dvec2 pixel;
  double reach = 1.0;
};
WithinRaster bring_within(const source::RasterDescription& raster, int level, const glm::dvec2& pixel) {
  const source::LevelSize& full = raster.levels.front();
  glm::dvec2 nearest = glm::clamp(pixel, glm::dvec2(0.0), glm::dvec2(full.width, full.height));
  if (raster.wraps) nearest.x = pixel.x;
  const glm::dvec2 beyond = glm::abs(pixel - nearest) * scale_of_level(raster, level);
  return {nearest, std::max(0.0, 1.0 - beyond.x) * std::max(0.0, 1.0 - beyond.y)};
}

}  // namespace

int level_for_spacing(const source::RasterDescription& raster, double wanted_spacing) {
  // Levels of maps of the whole body have the very spacings of the surface's tiles: rounding must not choose the finer one.
  constexpr double kAsFine = 1.001;
  const int last = static_cast<int>(raster.levels.size()) - 1;
  int level = 0;
  while (level < last && spacing_of_level(raster, level + 1) <= kAsFine * wanted_spacing) ++level;
  return level;
}

Result<ElevationModel> ElevationModel::open(std::shared_ptr<const SurfaceDescription> description,
                                            cache::BlockCache& cache) {
  ElevationModel model;
  model.cache_ = &cache;
  for (const Layer& layer : description->heights) {
    if (!layer.enabled) continue;
    if (layer.catalogue) {
      model.has_catalogue_ = true;
      continue;
    }
    Result<cache::CachedRaster> raster = cache::CachedRaster::open(*layer.source, cache, layer.source_id, layer.content);
    if (!raster) return raster.error();
    const source::RasterDescription& about = layer.source->description();
    const Extent extent = extent_of(about, raster->reader());
    model.layers_.emplace(&layer, HeightLayer{layer.source_id, layer.source, std::move(*raster), reach_of(about), extent, {}, {}});
  }
  model.description_ = std::move(description);
  return model;
}

// --- What contributes ------------------------------------------------------------------------------------------------

namespace {

constexpr std::size_t kIdleDataSets = 64;      ///< kept open for the next batch
constexpr std::size_t kMostContributors = 128; ///< of a catalogue to a batch: what lies below so many is hidden

/// A region that holds all places.
source::FaceRegion region_round(std::span<const geo::LatLon> places) {
  const int face = geo::face_point(geo::normal_at(places.front())).face;
  geo::FaceRect rect{glm::dvec2(INFINITY), glm::dvec2(-INFINITY)};
  for (const geo::LatLon& place : places) {
    const std::optional<glm::dvec2> at = geo::project_to_face(face, geo::normal_at(place));
    constexpr double kFarthest = 1.5;
    if (!at || std::max(std::abs(at->x), std::abs(at->y)) > kFarthest) return {face, {glm::dvec2(-2.0), glm::dvec2(2.0)}, {}};
    rect = {glm::min(rect.lower, *at), glm::max(rect.upper, *at)};
  }
  return source::region_of(face, rect);
}

source::FaceRegion region_of(const TileLattice& lattice) {
  const geo::FaceRect tile = geo::face_rect(lattice.key);
  return source::region_of(lattice.key.face, {glm::mix(tile.lower, tile.upper, lattice.first), glm::mix(tile.lower, tile.upper, lattice.last)});
}

}  // namespace

void ElevationModel::choose(const source::FaceRegion& region, double wanted_spacing) {
  contributors_.clear();
  region_ = region;
  close_unused();
  const Radians least(kNarrowestDataSet * wanted_spacing / description_->ellipsoid.a());
  for (const Layer& layer : description_->heights) {
    if (!layer.enabled) continue;
    if (!layer.catalogue) {
      contributors_.push_back({&layer, &layers_.at(&layer), 0});
      continue;
    }
    layer.catalogue->find(region, least, found_);
    if (found_.size() > kMostContributors) found_.resize(kMostContributors);
    for (const std::uint32_t index : std::views::reverse(found_)) contributors_.push_back({&layer, nullptr, index});
  }
}

void ElevationModel::choose(std::span<const geo::LatLon> places, double wanted_spacing) {
  choose(has_catalogue_ ? region_round(places) : source::FaceRegion{}, wanted_spacing);
}

/// Closes those of catalogues that were not used lately.
void ElevationModel::close_unused() {
  auto last = data_sets_.end();
  for (std::size_t open = data_sets_.size(); open > kIdleDataSets && last != data_sets_.begin(); --open) {
    --last;
    if (last->second.raster.is_pending()) continue;  // the build that it belongs to has not asked yet
    data_set_index_.erase(last->first);
    last = data_sets_.erase(last);
  }
}

/// Null if it cannot be opened; the catalogue knows why.
ElevationModel::HeightLayer* ElevationModel::open_data_set(const source::Catalogue& catalogue, std::uint32_t index) {
  const std::uint32_t id = catalogue.sets()[index]->id;
  if (const auto found = data_set_index_.find(id); found != data_set_index_.end()) {
    data_sets_.splice(data_sets_.begin(), data_sets_, found->second);
    return &found->second->second;
  }
  auto source = catalogue.open(index);
  if (!source) {
    // What will never be there is no reason to build the tile again.
    if (source.error().code == ErrorCode::unavailable) can_do_without(id, source.error());
    return nullptr;
  }
  Result<cache::CachedRaster> raster = cache::CachedRaster::open(**source, *cache_, id);
  if (!raster) return nullptr;
  const source::RasterDescription& about = (*source)->description();
  const Extent extent = extent_of(about, raster->reader());
  if (!reads_) raster->read_nothing();
  data_sets_.emplace_front(id, HeightLayer{id, std::move(*source), std::move(*raster), reach_of(about), extent, {}, {}});
  data_set_index_[id] = data_sets_.begin();
  return &data_sets_.front().second;
}

/// If so it is noted.
bool ElevationModel::can_do_without(std::uint32_t id, const Error& error) const {
  if (missing_ == nullptr || error.code == ErrorCode::cancelled || error.code == ErrorCode::pending) return false;
  if (std::ranges::find(*missing_, id, &MissingLayer::source_id) == missing_->end()) missing_->push_back({id, error});
  return true;
}

ElevationModel::HeightLayer* ElevationModel::open(Contributor& contributor) {
  if (contributor.raster == nullptr) contributor.raster = open_data_set(*contributor.settings->catalogue, contributor.index);
  return contributor.raster;
}

Result<void> ElevationModel::for_each_under(const geo::TileKey& key, const Visit& visit) {
  for (const Layer& layer : description_->heights) {
    if (!layer.enabled) continue;
    if (!layer.catalogue) {
      if (!layer.source->coverage().touches(key)) continue;
      if (Result<void> visited = visit(layers_.at(&layer).raster, layer.source->coverage().spacing_under(key)); !visited) return visited;
      continue;
    }
    std::vector<std::uint32_t> found;
    layer.catalogue->find(source::region_of(key), Radians(0), found);
    if (found.size() > kMostContributors) found.resize(kMostContributors);
    for (const std::uint32_t index : std::views::reverse(found)) {
      close_unused();
      HeightLayer* raster = open_data_set(*layer.catalogue, index);
      if (raster == nullptr) continue;
      if (Result<void> visited = visit(raster->raster, layer.catalogue->sets()[index]->footprint.spacing()); !visited) return visited;
    }
  }
  return {};
}

/// Places whose heights are wanted: how a layer sees them, and where the answers go.
struct ElevationModel::Batch {
  double wanted_spacing;
  std::span<double> metres;
  std::span<double> spacings;  ///< of the finest layer that contributed

  /// Fills `inside` and `pixels` of a raster's samples, with those of `which` that it reaches.
  virtual void find(HeightLayer& layer, std::span<const std::uint32_t> which) = 0;
  /// Where `which` lie in a raster, or beyond its borders.
  virtual void to_pixels(HeightLayer& layer, std::span<const std::uint32_t> which, std::vector<glm::dvec2>& pixels) = 0;

 protected:
  Batch(double wanted, std::span<double> m, std::span<double> s) : wanted_spacing(wanted), metres(m), spacings(s) {}
  ~Batch() = default;
};

struct ElevationModel::PlaceBatch final : Batch {
  PlaceBatch(std::span<const geo::LatLon> p, std::vector<geo::LatLon>& room, double wanted, std::span<double> m, std::span<double> s)
      : Batch(wanted, m, s), places(p), inside_places(room) {}

  void find(HeightLayer& layer, std::span<const std::uint32_t> which) override {
    RasterSamples& out = layer.samples;
    inside_places.clear();
    for (const std::uint32_t i : which) {
      if (!holds(layer.reach, places[i])) continue;
      out.inside.push_back(i);
      inside_places.push_back(places[i]);
    }
    out.pixels.resize(out.inside.size());
    layer.raster.reader().to_pixels(inside_places, out.pixels);
  }

  void to_pixels(HeightLayer& layer, std::span<const std::uint32_t> which, std::vector<glm::dvec2>& pixels) override {
    inside_places.clear();
    for (const std::uint32_t i : which) inside_places.push_back(places[i]);
    pixels.resize(which.size());
    layer.raster.reader().to_pixels(inside_places, pixels);
  }

  std::span<const geo::LatLon> places;
  std::vector<geo::LatLon>& inside_places;
};

/// Some rows of a lattice.
struct ElevationModel::LatticeBatch final : Batch {
  LatticeBatch(const TileLattice& lattice, std::vector<glm::dvec2>& r, double wanted) : Batch(wanted, {}, {}), points(lattice), room(r) {}

  void choose_rows(int first, std::span<double> m, std::span<double> s) {
    first_row = first;
    metres = m;
    spacings = s;
  }

  void find(HeightLayer& layer, std::span<const std::uint32_t> which) override {
    if (!overlap(points.bounds(), layer.reach)) return;
    find_rows(layer);
    // A pixel beyond the border coverage ends.
    const source::RasterDescription& raster = layer.raster.description();
    const glm::dvec2 lowest = -1.0 / source::level_scale(raster, level_for_spacing(raster, wanted_spacing));
    const glm::dvec2 highest = glm::dvec2(raster.levels.front().width, raster.levels.front().height) - lowest;
    RasterSamples& out = layer.samples;
    for (const std::uint32_t i : which) {
      const glm::dvec2& pixel = room[i];
      const bool in_x = raster.wraps || (pixel.x > lowest.x && pixel.x < highest.x);
      if (!in_x || !(pixel.y > lowest.y && pixel.y < highest.y)) continue;
      out.inside.push_back(i);
      out.pixels.push_back(pixel);
    }
  }

  void to_pixels(HeightLayer& layer, std::span<const std::uint32_t> which, std::vector<glm::dvec2>& pixels) override {
    find_rows(layer);
    pixels.clear();
    for (const std::uint32_t i : which) pixels.push_back(room[i]);
  }

  /// Fills `room` with all of the rows.
  void find_rows(HeightLayer& layer) {
    auto found = in_rasters.find(&layer);
    if (found == in_rasters.end()) {
      const source::RasterDescription& raster = layer.raster.description();
      found = in_rasters.emplace(&layer, points.in_raster(layer.raster.reader(), raster, level_for_spacing(raster, wanted_spacing))).first;
    }
    room.resize(metres.size());
    found->second.rows(first_row, room);
  }

  int first_row = 0;
  LatticePixels points;
  std::unordered_map<const HeightLayer*, LatticePixels::InRaster> in_rasters;
  std::vector<glm::dvec2>& room;
};

void ElevationModel::read_nothing() {
  reads_ = false;
  for (auto& [settings, layer] : layers_) layer.raster.read_nothing();
  for (auto& [id, layer] : data_sets_) layer.raster.read_nothing();
}

bool ElevationModel::is_pending() const {
  const auto waits = [](const auto& entry) { return entry.second.raster.is_pending(); };
  return std::ranges::any_of(layers_, waits) || std::ranges::any_of(data_sets_, waits);
}

bool ElevationModel::take_pending(source::Awaited& awaited) {
  bool pending = false;
  const auto take = [&](HeightLayer& layer) {
    if (!layer.raster.take_pending(awaited)) return;
    pending = true;
    layer.beyond.clear();  // may have been made of zeros
  };
  for (auto& [settings, layer] : layers_) take(layer);
  for (auto& [id, layer] : data_sets_) take(layer);
  return pending;
}

std::span<const std::uint32_t> ElevationModel::all_of(std::size_t count) {
  for (std::size_t i = numbers_.size(); i < count; ++i) numbers_.push_back(static_cast<std::uint32_t>(i));
  return std::span(numbers_).first(count);
}

Result<void> ElevationModel::heights(std::span<const geo::Vector<geo::Ecef>> normals, double wanted_spacing,
                                     std::span<double> metres) {
  assert(normals.size() == metres.size());
  for (std::size_t first = 0; first < normals.size(); first += kPlacesAtOnce) {
    const auto some = normals.subspan(first, std::min(kPlacesAtOnce, normals.size() - first));
    places_.resize(some.size());
    std::transform(some.begin(), some.end(), places_.begin(), geo::place_of_normal);
    if (Result<void> found = heights(std::span<const geo::LatLon>(places_), wanted_spacing, metres.subspan(first, some.size())); !found) return found;
  }
  return {};
}

Result<void> ElevationModel::heights(std::span<const geo::LatLon> places, double wanted_spacing,
                                     std::span<double> metres) {
  assert(places.size() == metres.size());
  for (std::size_t first = 0; first < places.size(); first += kPlacesAtOnce) {
    const std::size_t count = std::min(kPlacesAtOnce, places.size() - first);
    spacings_.resize(count);
    choose(places.subspan(first, count), wanted_spacing);
    PlaceBatch batch(places.subspan(first, count), inside_places_, wanted_spacing, metres.subspan(first, count), spacings_);
    if (Result<void> composed = compose(batch, contributors_.size(), all_of(count)); !composed) return composed;
  }
  return {};
}

Result<void> ElevationModel::heights(const TileLattice& lattice, double wanted_spacing, std::span<double> metres) {
  assert(metres.size() == static_cast<std::size_t>(lattice.side) * static_cast<std::size_t>(lattice.side));
  const int rows_at_once = std::max(1, static_cast<int>(kPlacesAtOnce) / lattice.side);
  choose(region_of(lattice), wanted_spacing);
  LatticeBatch batch(lattice, lattice_pixels_, wanted_spacing);
  for (int row = 0; row < lattice.side; row += rows_at_once) {
    const auto first = static_cast<std::size_t>(row) * static_cast<std::size_t>(lattice.side);
    const auto count = static_cast<std::size_t>(std::min(rows_at_once, lattice.side - row)) * static_cast<std::size_t>(lattice.side);
    spacings_.resize(count);
    batch.choose_rows(row, metres.subspan(first, count), spacings_);
    if (Result<void> composed = compose(batch, contributors_.size(), all_of(count)); !composed) return composed;
  }
  return {};
}

/// Heights at the places `which`, by the lowest `count` contributors. Those below a layer are asked, and opened, only where it does not
/// hide them.
Result<void> ElevationModel::compose(Batch& batch, std::size_t count, std::span<const std::uint32_t> which) {
  if (which.empty()) return {};
  if (count == 0) {
    for (const std::uint32_t i : which) {
      batch.metres[i] = 0.0;
      batch.spacings[i] = std::numeric_limits<double>::infinity();
    }
    return {};
  }
  const Layer& layer = *contributors_[count - 1].settings;
  std::size_t first = count - 1;
  while (first > 0 && contributors_[first - 1].settings == &layer) --first;
  const std::span rasters = std::span(contributors_).subspan(first, count - first);

  LayerAnswer& answer = answers_[&layer];
  if (Result<void> asked = ask_layer(batch, rasters, which, answer); !asked) return asked;
  if (Result<void> composed = compose(batch, first, answer.undecided); !composed) return composed;
  if (!layer.adds) {
    if (Result<void> filled = fill_voids(batch, rasters, answer.open); !filled) return filled;
  }
  for (const OpenPlace& open : answer.open) {
    compose_one(batch.metres[open.place], open.height, layer.adds);
    if (open.height.coverage > 0.0) batch.spacings[open.place] = std::min(batch.spacings[open.place], open.finest);
  }
  return {};
}

/// What the rasters of a layer, uppermost last, say of `which`: answers those places that its uppermost raster hides, leaves the others it
/// reaches in `open`, and in `undecided` all to which layers below contribute.
Result<void> ElevationModel::ask_layer(Batch& batch, std::span<Contributor> rasters, std::span<const std::uint32_t> which, LayerAnswer& answer) {
  const bool adds = rasters.front().settings->adds;
  answer.open.clear();
  answer.open_of.assign(batch.metres.size(), -1);
  answer.undecided.assign(which.begin(), which.end());
  for (Contributor& contributor : std::views::reverse(rasters)) {
    if (answer.undecided.empty()) break;
    HeightLayer* const raster = open(contributor);
    if (raster == nullptr) continue;
    RasterSamples& samples = raster->samples;
    samples.inside.clear();
    samples.pixels.clear();
    batch.find(*raster, answer.undecided);
    if (samples.inside.empty()) continue;
    const source::RasterDescription& about = raster->raster.description();
    const int level = level_for_spacing(about, batch.wanted_spacing);
    const double spacing = spacing_of_level(about, level);
    samples.heights.resize(samples.inside.size());
    if (Result<void> read = raster->raster.sample_heights(level, samples.pixels, samples.heights); !read) {
      if (can_do_without(raster->id, read.error())) continue;
      return read;
    }

    answer.next.clear();
    std::size_t n = 0;  // of the places inside, which are in the order of the undecided
    for (const std::uint32_t i : answer.undecided) {
      if (n == samples.inside.size() || samples.inside[n] != i) {
        answer.next.push_back(i);
        continue;
      }
      cache::HeightSample sample = samples.heights[n];
      const glm::dvec2& pixel = samples.pixels[n++];
      const double opacity = opacity_of(*contributor.settings, raster->extent, pixel);
      sample.coverage *= opacity;
      std::int32_t& known = answer.open_of[i];
      if (known < 0 && sample.coverage >= 1.0 && !adds) {
        batch.metres[i] = sample.metres;
        batch.spacings[i] = spacing;
        continue;
      }
      if (known < 0) {
        known = static_cast<std::int32_t>(answer.open.size());
        answer.open.push_back({.place = i, .finest = std::numeric_limits<double>::infinity()});
      }
      OpenPlace& open = answer.open[static_cast<std::size_t>(known)];
      if (is_finite(pixel)) open.reach = std::max(open.reach, opacity * bring_within(about, level, pixel).reach);
      if (sample.coverage > 0.0) open.finest = std::min(open.finest, spacing);
      lay_under(open.height, sample);
      if (open.height.coverage < 1.0) {
        answer.next.push_back(i);
      } else if (!adds) {  // hidden by several together
        batch.metres[i] = 0.0;
        batch.spacings[i] = std::numeric_limits<double>::infinity();
      }
    }
    std::swap(answer.undecided, answer.next);
  }
  if (adds) {
    for (const OpenPlace& open : answer.open) {
      if (open.height.coverage >= 1.0) answer.undecided.push_back(open.place);
    }
  }
  return {};
}

/// Fills a layer's voids from coarser levels of its rasters, as far as those are finer than what lies below. One step of twice the spacing
/// after the other, each from all rasters together, so that neighbours meet: steps and levels depend on nothing but the place.
Result<void> ElevationModel::fill_voids(Batch& batch, std::span<Contributor> rasters, std::vector<OpenPlace>& open) {
  voids_.clear();
  void_places_.clear();
  double coarsest = 0.0;
  for (OpenPlace& place : open) {
    if (!place.is_void()) continue;
    voids_.push_back(&place);
    void_places_.push_back(place.place);
    coarsest = std::max(coarsest, batch.spacings[place.place]);
  }
  if (voids_.empty()) return {};
  choose_fillers(batch, rasters, coarsest);
  int first = std::numeric_limits<int>::max(), last = std::numeric_limits<int>::min();
  for (const Filler& filler : fillers_) {
    const double spacing = filler.raster->raster.description().spacing.value;
    first = std::min(first, step_of(spacing) + filler.level + 1);
    last = std::max(last, step_of(std::min(coarsest, std::ldexp(spacing, kCoarsestFill))));
  }
  for (int step = first; step <= last; ++step) {
    fills_.assign(voids_.size(), {});
    for (const Filler& filler : fillers_) {
      const int level = step - step_of(filler.raster->raster.description().spacing.value);
      if (level <= filler.level || level > kCoarsestFill) continue;
      if (Result<void> filled = fill_from(filler, level, batch.spacings); !filled) return filled;
    }
    for (std::size_t v = 0; v < voids_.size(); ++v) {
      if (fills_[v].coverage <= 0.0) continue;
      lay_under(voids_[v]->height, fills_[v], voids_[v]->reach);
    }
  }
  return {};
}

/// The rasters of a layer that reach the batch's region at their coarser levels too.
void ElevationModel::choose_fillers(Batch& batch, std::span<Contributor> rasters, double farthest) {
  fillers_.clear();
  const auto add = [&](HeightLayer* raster) {
    if (raster == nullptr) return;
    const int level = level_for_spacing(raster->raster.description(), batch.wanted_spacing);
    if (level >= kCoarsestFill || spacing_of_level(raster->raster.description(), level + 1) > farthest) return;
    Filler& filler = fillers_.emplace_back(Filler{raster, level, {}});
    batch.to_pixels(*raster, void_places_, filler.pixels);
  };
  const Layer& layer = *rasters.front().settings;
  if (!layer.catalogue) return add(rasters.front().raster);
  double widest = 0.0;
  for (const Contributor& contributor : rasters) {
    widest = std::max(widest, std::ldexp(layer.catalogue->sets()[contributor.index]->footprint.spacing().value, kCoarsestFill));
  }
  constexpr double kFaceUnitsPerRadian = 2.5;  // 4 / pi, and more: near a corner a unit is shorter
  const glm::dvec2 margin(std::min(kFaceUnitsPerRadian * std::min(widest, farthest) / description_->ellipsoid.b(), 1.0));
  const source::FaceRegion wider = source::region_of(region_.face, {region_.rect.lower - margin, region_.rect.upper + margin});
  layer.catalogue->find(wider, Radians(kNarrowestDataSet * batch.wanted_spacing / description_->ellipsoid.a()), found_);
  if (found_.size() > kMostContributors) found_.resize(kMostContributors);
  for (const std::uint32_t index : found_) add(open_data_set(*layer.catalogue, index));
}

/// Lays a level of a raster under `fills_`, where it is finer than what lies below (`spacings`).
Result<void> ElevationModel::fill_from(const Filler& filler, int level, std::span<const double> spacings) {
  const source::RasterDescription& about = filler.raster->raster.description();
  const double spacing = spacing_of_level(about, level);
  reached_.clear();
  void_pixels_.clear();
  for (std::uint32_t v = 0; v < voids_.size(); ++v) {
    const OpenPlace& place = *voids_[v];
    if (spacing > spacings[place.place] || !place.is_void() || fills_[v].coverage >= 1.0 || !is_finite(filler.pixels[v])) continue;
    const WithinRaster within = bring_within(about, level, filler.pixels[v]);
    if (within.reach <= 0.0) continue;
    reached_.push_back(v);
    void_pixels_.push_back(within.pixel);
  }
  void_heights_.resize(reached_.size());
  if (Result<void> read = sample_level(*filler.raster, level, void_pixels_, void_heights_); !read) return can_do_without(filler.raster->id, read.error()) ? Result<void>() : read;
  for (std::size_t n = 0; n < reached_.size(); ++n) {
    void_heights_[n].coverage *= bring_within(about, level, filler.pixels[reached_[n]]).reach;
    OpenPlace& place = *voids_[reached_[n]];
    if (place.height.coverage == 0.0 && void_heights_[n].coverage > 0.0) place.finest = std::min(place.finest, spacing);
    lay_under(fills_[reached_[n]], void_heights_[n]);
  }
  return {};
}

/// Samples of a level within the raster, whether the raster has that level or not.
Result<void> ElevationModel::sample_level(HeightLayer& layer, int level, std::span<const glm::dvec2> pixels, std::span<cache::HeightSample> heights) {
  const int last = static_cast<int>(layer.raster.description().levels.size()) - 1;
  if (level <= last) return layer.raster.sample_heights(level, pixels, heights);
  while (static_cast<int>(layer.beyond.size()) < level - last) {
    if (layer.beyond.empty()) {
      const Result<CoarseHeights> known = last_level(layer.raster);
      if (!known) return known.error();
      layer.beyond.push_back(next_level(*known));
    } else {
      layer.beyond.push_back(next_level(layer.beyond.back()));
    }
  }
  const CoarseHeights& coarse = layer.beyond[static_cast<std::size_t>(level - last - 1)];
  std::ranges::transform(pixels, heights.begin(), [&](const glm::dvec2& pixel) { return coarse.sample(pixel); });
  return {};
}

Result<ElevationAnswer> ElevationModel::height_at(const geo::LatLon& place, Lookup lookup, double wanted_spacing) {
  ElevationAnswer answer{0.0, std::numeric_limits<double>::infinity()};
  if (lookup == Lookup::bilinear) {
    choose(std::span(&place, 1), wanted_spacing);
    PlaceBatch batch({&place, 1}, inside_places_, wanted_spacing, {&answer.metres, 1}, {&answer.spacing, 1});
    const Result<void> read = compose(batch, contributors_.size(), all_of(1));
    return read ? Result<ElevationAnswer>(answer) : read.error();
  }
  choose(std::span(&place, 1), wanted_spacing);
  struct Answered {
    cache::HeightSample sample;
    bool adds;
    double spacing;
  };
  std::vector<Answered> from_the_top;
  const Layer* answered_by = nullptr;
  for (Contributor& contributor : std::views::reverse(contributors_)) {
    if (contributor.settings == answered_by) continue;  // of several rasters of a layer only the uppermost counts
    HeightLayer* opened = open(contributor);
    if (opened == nullptr || !holds(opened->reach, place)) continue;
    HeightLayer& layer = *opened;
    const source::RasterDescription& raster = layer.raster.description();
    const int level = level_for_spacing(raster, wanted_spacing);
    glm::dvec2 pixel;
    layer.raster.reader().to_pixels({&place, 1}, {&pixel, 1});
    const source::LevelSize& full = raster.levels.front();
    const bool within = pixel.x >= 0.0 && pixel.x <= full.width && pixel.y >= 0.0 && pixel.y <= full.height;
    if (!within) continue;
    // At a sample's own place the bilinear value is the sample.
    const glm::dvec2 scale = source::level_scale(raster, level);
    const source::LevelSize& size = raster.levels[static_cast<std::size_t>(level)];
    const glm::dvec2 last(size.width - 1, size.height - 1);
    pixel = (glm::min(glm::floor(pixel * scale), last) + 0.5) / scale;
    cache::HeightSample sample;
    if (Result<void> read = layer.raster.sample_heights(level, {&pixel, 1}, {&sample, 1}); !read) return read.error();
    sample.coverage *= opacity_of(*contributor.settings, layer.extent, pixel);
    const bool adds = contributor.settings->adds;
    if (sample.coverage > 0.0) {
      from_the_top.push_back({sample, adds, spacing_of_level(raster, level)});
      answered_by = contributor.settings;
    }
    if (sample.coverage >= 1.0 && !adds) break;  // hides what lies below
  }
  for (const Answered& answered : std::views::reverse(from_the_top)) {
    compose_one(answer.metres, answered.sample, answered.adds);
    answer.spacing = std::min(answer.spacing, answered.spacing);
  }
  return answer;
}

Result<geo::Vector<geo::Ecef>> ElevationModel::surface_normal_at(const geo::LatLon& place, double wanted_spacing) {
  const geo::Vector<geo::Ecef> up = geo::normal_at(place);
  const Result<ElevationAnswer> here = height_at(place, Lookup::bilinear, wanted_spacing);
  if (!here) return here.error();
  if (!std::isfinite(here->spacing)) return up;
  // Central differences over a thousandth of a sample: inside a cell that is the bilinear surface's own tangent, on a sample
  // or a cell's border the mean of both sides.
  const double step = 1e-3 * here->spacing / description_->ellipsoid.a();
  const double sine = std::sin(place.longitude.value), cosine = std::cos(place.longitude.value);
  const glm::dvec3 east(-sine, cosine, 0.0);
  const glm::dvec3 north = glm::cross(up.xyz, east);
  std::array<geo::Vector<geo::Ecef>, 4> normals;
  const std::array<glm::dvec3, 4> directions{-east, east, -north, north};
  for (std::size_t i = 0; i < 4; ++i) normals[i].xyz = glm::normalize(up.xyz + step * directions[i]);
  std::array<double, 4> metres{};
  if (Result<void> read = heights(normals, wanted_spacing, metres); !read) return read.error();
  std::array<glm::dvec3, 4> points;
  for (std::size_t i = 0; i < 4; ++i) {
    points[i] = geo::surface_point(description_->ellipsoid, normals[i]).xyz + metres[i] * normals[i].xyz;
  }
  return geo::Vector<geo::Ecef>{glm::normalize(glm::cross(points[1] - points[0], points[3] - points[2]))};
}

}  // namespace tellurion::surface
