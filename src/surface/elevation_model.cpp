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

void compose_one(double& below, const cache::HeightSample& sample, bool adds) {
  below += sample.coverage * (adds ? sample.metres : sample.metres - below);
}

bool is_finite(const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// The place within the raster nearest to a pixel, and the share of the raster's coverage that is left there.
struct WithinRaster {
  glm::dvec2 pixel;
  double reach = 1.0;
};
WithinRaster bring_within(const source::RasterDescription& raster, int level, const glm::dvec2& pixel) {
  const source::LevelSize& full = raster.levels.front();
  glm::dvec2 nearest = glm::clamp(pixel, glm::dvec2(0.0), glm::dvec2(full.width, full.height));
  if (raster.wraps) nearest.x = pixel.x;
  const glm::dvec2 beyond = glm::abs(pixel - nearest) * source::level_scale(raster, level);
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
    Result<cache::CachedRaster> raster = cache::CachedRaster::open(*layer.source, cache, layer.source_id);
    if (!raster) return raster.error();
    model.layers_.emplace(&layer, HeightLayer{layer.source, std::move(raster).value(), reach_of(layer.source->description()), {}, {}});
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
  if (!source) return nullptr;
  Result<cache::CachedRaster> raster = cache::CachedRaster::open(**source, *cache_, id);
  if (!raster) return nullptr;
  const geo::GeodeticBounds reach = reach_of((*source)->description());
  data_sets_.emplace_front(id, HeightLayer{std::move(*source), std::move(raster).value(), reach, {}, {}});
  data_set_index_[id] = data_sets_.begin();
  return &data_sets_.front().second;
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

  /// Fills `inside` and `pixels` of a contributor's samples, with those of `which` that it reaches.
  virtual void find(HeightLayer& layer, std::size_t contributor, std::span<const std::uint32_t> which) = 0;

 protected:
  Batch(double wanted, std::span<double> m, std::span<double> s) : wanted_spacing(wanted), metres(m), spacings(s) {}
  ~Batch() = default;
};

struct ElevationModel::PlaceBatch final : Batch {
  PlaceBatch(std::span<const geo::LatLon> p, std::vector<geo::LatLon>& room, double wanted, std::span<double> m, std::span<double> s)
      : Batch(wanted, m, s), places(p), inside_places(room) {}

  void find(HeightLayer& layer, std::size_t, std::span<const std::uint32_t> which) override {
    LayerSamples& out = layer.samples;
    inside_places.clear();
    for (const std::uint32_t i : which) {
      if (!holds(layer.reach, places[i])) continue;
      out.inside.push_back(i);
      inside_places.push_back(places[i]);
    }
    out.pixels.resize(out.inside.size());
    layer.raster.reader().to_pixels(inside_places, out.pixels);
  }

  std::span<const geo::LatLon> places;
  std::vector<geo::LatLon>& inside_places;
};

/// Some rows of a lattice.
struct ElevationModel::LatticeBatch final : Batch {
  LatticeBatch(const TileLattice& lattice, std::size_t contributors, std::vector<glm::dvec2>& r, double wanted)
      : Batch(wanted, {}, {}), points(lattice), in_rasters(contributors), room(r) {}

  void choose_rows(int first, std::span<double> m, std::span<double> s) {
    first_row = first;
    metres = m;
    spacings = s;
  }

  void find(HeightLayer& layer, std::size_t contributor, std::span<const std::uint32_t> which) override {
    if (!overlap(points.bounds(), layer.reach)) return;
    const source::RasterDescription& raster = layer.raster.description();
    const int level = level_for_spacing(raster, wanted_spacing);
    std::optional<LatticePixels::InRaster>& in_raster = in_rasters[contributor];
    if (!in_raster) in_raster = points.in_raster(layer.raster.reader(), raster, level);
    room.resize(metres.size());
    in_raster->rows(first_row, room);
    // A pixel beyond the border coverage ends.
    const glm::dvec2 lowest = -1.0 / source::level_scale(raster, level);
    const glm::dvec2 highest = glm::dvec2(raster.levels.front().width, raster.levels.front().height) - lowest;
    LayerSamples& out = layer.samples;
    for (const std::uint32_t i : which) {
      const glm::dvec2& pixel = room[i];
      const bool in_x = raster.wraps || (pixel.x > lowest.x && pixel.x < highest.x);
      if (!in_x || !(pixel.y > lowest.y && pixel.y < highest.y)) continue;
      out.inside.push_back(i);
      out.pixels.push_back(pixel);
    }
  }

  int first_row = 0;
  LatticePixels points;
  std::vector<std::optional<LatticePixels::InRaster>> in_rasters;  ///< of the contributors
  std::vector<glm::dvec2>& room;
};

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
  LatticeBatch batch(lattice, contributors_.size(), lattice_pixels_, wanted_spacing);
  for (int row = 0; row < lattice.side; row += rows_at_once) {
    const auto first = static_cast<std::size_t>(row) * static_cast<std::size_t>(lattice.side);
    const auto count = static_cast<std::size_t>(std::min(rows_at_once, lattice.side - row)) * static_cast<std::size_t>(lattice.side);
    spacings_.resize(count);
    batch.choose_rows(row, metres.subspan(first, count), spacings_);
    if (Result<void> composed = compose(batch, contributors_.size(), all_of(count)); !composed) return composed;
  }
  return {};
}

/// Heights at the places `which`, by the lowest `count` contributors. Those below are asked, and opened, only where the uppermost of
/// these does not hide them.
Result<void> ElevationModel::compose(Batch& batch, std::size_t count, std::span<const std::uint32_t> which) {
  if (which.empty()) return {};
  if (count == 0) {
    for (const std::uint32_t i : which) {
      batch.metres[i] = 0.0;
      batch.spacings[i] = std::numeric_limits<double>::infinity();
    }
    return {};
  }
  HeightLayer* opened = open(contributors_[count - 1]);
  if (opened == nullptr) return compose(batch, count - 1, which);
  HeightLayer& layer = *opened;
  LayerSamples& samples = layer.samples;
  samples.inside.clear();
  samples.pixels.clear();
  batch.find(layer, count - 1, which);
  if (samples.inside.empty()) return compose(batch, count - 1, which);

  const int level = level_for_spacing(layer.raster.description(), batch.wanted_spacing);
  const bool adds = contributors_[count - 1].settings->adds;
  samples.heights.resize(samples.inside.size());
  if (Result<void> read = layer.raster.sample_heights(level, samples.pixels, samples.heights); !read) return read;

  samples.finest.assign(samples.inside.size(), spacing_of_level(layer.raster.description(), level));

  samples.open.clear();
  samples.below.clear();
  std::size_t n = 0;  // of the places inside, which are in the order of `which`
  for (const std::uint32_t i : which) {
    if (n == samples.inside.size() || samples.inside[n] != i) {
      samples.below.push_back(i);
      continue;
    }
    if (samples.heights[n].coverage >= 1.0 && !adds) {
      batch.metres[i] = samples.heights[n].metres;
      batch.spacings[i] = samples.finest[n];
    } else {
      samples.below.push_back(i);
      samples.open.push_back(static_cast<std::uint32_t>(n));
    }
    ++n;
  }
  if (Result<void> composed = compose(batch, count - 1, samples.below); !composed) return composed;
  // Voids of a catalogue's rasters show what lies below: filled from their own coarser levels, neighbours would not meet.
  if (!adds && !contributors_[count - 1].settings->catalogue) {
    if (Result<void> filled = fill_voids(layer, level, batch.spacings); !filled) return filled;
  }
  for (const std::uint32_t open : samples.open) {
    const std::uint32_t i = samples.inside[open];
    const cache::HeightSample& sample = samples.heights[open];
    compose_one(batch.metres[i], sample, adds);
    if (sample.coverage > 0.0) batch.spacings[i] = std::min(batch.spacings[i], samples.finest[open]);
  }
  return {};
}

/// Fills a layer's voids from its coarser levels, as far as those are finer than what lies below (`spacings`).
Result<void> ElevationModel::fill_voids(HeightLayer& layer, int level, std::span<double> spacings) {
  const source::RasterDescription& raster = layer.raster.description();
  LayerSamples& samples = layer.samples;
  const auto reach = [&](std::uint32_t n) { return bring_within(raster, level, samples.pixels[n]).reach; };
  samples.voids.clear();
  for (const std::uint32_t n : samples.open) {
    if (is_finite(samples.pixels[n]) && reach(n) > 0.0) samples.voids.push_back(n);
  }
  for (int coarse = level + 1; coarse <= kCoarsestFill && !samples.voids.empty(); ++coarse) {
    const double spacing = spacing_of_level(raster, coarse);
    std::erase_if(samples.voids, [&](std::uint32_t n) {
      return spacing > spacings[samples.inside[n]] || samples.heights[n].coverage >= reach(n);
    });
    samples.void_pixels.clear();
    for (const std::uint32_t n : samples.voids) samples.void_pixels.push_back(bring_within(raster, level, samples.pixels[n]).pixel);
    samples.void_heights.resize(samples.voids.size());
    if (Result<void> read = sample_voids(layer, coarse); !read) return read;
    for (std::size_t v = 0; v < samples.voids.size(); ++v) {
      cache::HeightSample& sample = samples.heights[samples.voids[v]];
      const cache::HeightSample& fill = samples.void_heights[v];
      const double added = (reach(samples.voids[v]) - sample.coverage) * fill.coverage;
      if (added <= 0.0) continue;
      if (sample.coverage == 0.0) samples.finest[samples.voids[v]] = spacing;
      const double coverage = sample.coverage + added;
      sample.metres += (fill.metres - sample.metres) * (added / coverage);
      sample.coverage = coverage;
    }
  }
  return {};
}

/// Samples of a level at the layer's void_pixels, whether the raster has that level or not.
Result<void> ElevationModel::sample_voids(HeightLayer& layer, int level) {
  const int last = static_cast<int>(layer.raster.description().levels.size()) - 1;
  if (level <= last) return layer.raster.sample_heights(level, layer.samples.void_pixels, layer.samples.void_heights);
  while (static_cast<int>(layer.beyond.size()) < level - last) {
    if (layer.beyond.empty()) {
      const Result<CoarseHeights> known = last_level(layer.raster);
      if (!known) return known.error();
      layer.beyond.push_back(next_level(*known));
    } else {
      layer.beyond.push_back(next_level(layer.beyond.back()));
    }
  }
  const CoarseHeights& heights = layer.beyond[static_cast<std::size_t>(level - last - 1)];
  std::transform(layer.samples.void_pixels.begin(), layer.samples.void_pixels.end(), layer.samples.void_heights.begin(),
                 [&](const glm::dvec2& pixel) { return heights.sample(pixel); });
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
  for (Contributor& contributor : std::views::reverse(contributors_)) {
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
    const bool adds = contributor.settings->adds;
    if (sample.coverage > 0.0) from_the_top.push_back({sample, adds, spacing_of_level(raster, level)});
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
