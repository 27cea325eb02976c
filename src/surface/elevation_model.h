// One elevation out of many height layers, at any place; and the tile contents built from it.
// Worker side: an ElevationModel belongs to one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <span>
#include <stop_token>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "cache/cached_raster.h"
#include "geo/ellipsoid.h"
#include "geo/tile_key.h"
#include "source/catalogue/catalogue.h"
#include "source/raster_source.h"
#include "surface/coarse_heights.h"
#include "surface/feather.h"
#include "surface/tile_content.h"
#include "surface/tile_grid.h"

namespace tellurion::surface {

/// A layer of a group as the surface sees it: a source, or a catalogue of many, and its settings. Immutable. Lowest layer first in
/// every list.
struct Layer {
  std::string name;
  std::shared_ptr<const source::RasterSource> source;
  std::shared_ptr<const source::Catalogue> catalogue{};  ///< instead of `source`
  std::uint32_t source_id = 0;   ///< number in the block cache's keys
  std::uint32_t content = 0;     ///< likewise: counts up when the source is read anew
  bool enabled = true;
  float opacity = 1.0f;
  float gamma = 1.0f;
  float multiplier = 1.0f;
  double feather = 0.0;          ///< pixels of a raster over which it fades inwards from its border, and images from their voids
  bool adds = false;             ///< height layers: added to the ones below instead of replacing them
  ImageUse use = ImageUse::colour;  ///< image layers: what they are drawn into

  friend bool operator==(const Layer&, const Layer&) = default;
};

/// Where the layer has data.
inline const source::Coverage& coverage_of(const Layer& layer) {
  return layer.catalogue ? static_cast<const source::Coverage&>(*layer.catalogue) : layer.source->coverage();
}

/// Data sets of a catalogue narrower than this many samples or texels of what is built are left out of it: from afar they are
/// specks, and there may be thousands.
inline constexpr double kNarrowestDataSet = 16.0;

/// The coarsest level of a layer that fills its voids: 64 samples across.
inline constexpr int kCoarsestFill = 6;

/// All that the surface is made of. Immutable, shared; a change makes a new one with a new revision.
struct SurfaceDescription {
  geo::Ellipsoid ellipsoid;
  std::vector<Layer> heights;
  std::vector<Layer> colours;   ///< of every use; each covers those of its own use only, and colour those of grayscale
  std::uint64_t revision = 0;
};

/// How to look a height up.
enum class Lookup { nearest, bilinear };

struct ElevationAnswer {
  double metres = 0;        ///< above the ellipsoid; 0 where no layer has data
  double spacing = 0;       ///< metres between the samples of the finest layer that contributed; infinite if none did
};

/// Height at places: every layer replaces the ones below by its coverage (see cache::HeightSample; from its border inwards by that of
/// its feather, see opacity_at), so the surface is continuous across voids and borders; 0 where there is nothing. The rasters of a catalogue are one layer: the finer (or the one named
/// later) replaces the others. A void inside a layer shows the finest data that there are: the layer's own coarser levels, made of the
/// samples round the void, as long as they are finer than the layers below (not beyond level kCoarsestFill); then those layers. So
/// a hole in a mountain's samples is no pit down to a coarse globe.
class ElevationModel {
 public:
  static Result<ElevationModel> open(std::shared_ptr<const SurfaceDescription> description, cache::BlockCache& cache);

  const SurfaceDescription& description() const { return *description_; }

  /// From now on answers rest on samples in memory alone, others count as on their way: see take_pending. Rasters of a catalogue are
  /// still opened when they are first met.
  void read_nothing();

  /// Bilinear heights at places given by unit normals, from every layer's coarsest level whose samples are at most
  /// `wanted_spacing` metres apart (0: the finest). Doubles: a float's step of 0.5 mm at 8 km would show in deep tiles.
  Result<void> heights(std::span<const geo::Vector<geo::Ecef>> normals, double wanted_spacing, std::span<double> metres);
  Result<void> heights(std::span<const geo::LatLon> places, double wanted_spacing, std::span<double> metres);
  /// The same at a lattice's points, for much less: see LatticePixels for how exact the places are.
  Result<void> heights(const TileLattice& lattice, double wanted_spacing, std::span<double> metres);

  /// One height. The same answer from either side of any sample, tile or face border. `nearest` fills no voids.
  Result<ElevationAnswer> height_at(const geo::LatLon& place, Lookup lookup, double wanted_spacing = 0);

  /// Unit normal of the elevation surface (bilinear) at `place`, ECEF.
  Result<geo::Vector<geo::Ecef>> surface_normal_at(const geo::LatLon& place, double wanted_spacing = 0);

  /// From now on, what cannot be read counts as void and is noted in `missing` instead of failing; null: it fails.
  void go_without(std::vector<MissingLayer>* missing) { missing_ = missing; }

  /// Whether an answer since the last call rests on samples that are on their way and stand in as 0; and what brings them.
  bool take_pending(source::Awaited& awaited);
  /// Whether it would say yes: what was read will be thrown away.
  bool is_pending() const;

  /// Calls `visit` with each raster of the enabled layers that touches the tile, lowest first, and the finest distance between its samples
  /// there. Ends with the first error.
  using Visit = std::function<Result<void>(cache::CachedRaster&, Metres spacing)>;
  Result<void> for_each_under(const geo::TileKey& key, const Visit& visit);

 private:
  /// What one raster says at the places of a batch that it reaches. The vectors are kept between calls.
  struct RasterSamples {
    std::vector<std::uint32_t> inside;    ///< the places, as indices into the batch
    std::vector<glm::dvec2> pixels;       ///< of `inside`
    std::vector<cache::HeightSample> heights;
  };
  /// An open raster: a layer's, or one of a catalogue.
  struct HeightLayer {
    std::uint32_t id = 0;
    std::shared_ptr<const source::RasterSource> source;
    cache::CachedRaster raster;
    geo::GeodeticBounds reach;         ///< outside of it the layer's coverage is 0
    Extent extent;
    std::vector<CoarseHeights> beyond; ///< levels after the raster's last, made when a void asks for them
    RasterSamples samples;
  };
  /// A raster that may contribute to the batch at hand.
  struct Contributor {
    const Layer* settings = nullptr;
    HeightLayer* raster = nullptr;     ///< null: of a catalogue, not opened yet
    std::uint32_t index = 0;           ///< in its catalogue
  };
  /// A place that a layer reaches but does not hide by its uppermost raster alone.
  struct OpenPlace {
    std::uint32_t place = 0;           ///< as an index into the batch
    cache::HeightSample height{};      ///< of the layer's rasters together
    double reach = 0;                  ///< the coverage that there would be without voids
    double finest = 0;                 ///< spacing of the finest level that answered

    bool is_void() const { return height.coverage < reach - 1e-9; }
  };
  /// What a layer says at the places of a batch. The vectors are kept between calls.
  struct LayerAnswer {
    std::vector<OpenPlace> open;
    std::vector<std::int32_t> open_of;      ///< by place, index into `open`; -1: none
    std::vector<std::uint32_t> undecided;   ///< places to which lower rasters contribute
    std::vector<std::uint32_t> next;
  };
  /// A raster that fills voids.
  struct Filler {
    HeightLayer* raster = nullptr;
    int level = 0;                          ///< at which it answered
    std::vector<glm::dvec2> pixels;         ///< of the voids
  };
  struct Batch;
  struct PlaceBatch;
  struct LatticeBatch;

  ElevationModel() = default;

  void choose(const source::FaceRegion& region, double wanted_spacing);
  void choose(std::span<const geo::LatLon> places, double wanted_spacing);
  HeightLayer* open(Contributor& contributor);
  HeightLayer* open_data_set(const source::Catalogue& catalogue, std::uint32_t index);
  void close_unused();
  bool can_do_without(std::uint32_t id, const Error& error) const;
  Result<void> compose(Batch& batch, std::size_t count, std::span<const std::uint32_t> which);
  Result<void> ask_layer(Batch& batch, std::span<Contributor> rasters, std::span<const std::uint32_t> which, LayerAnswer& answer);
  Result<void> fill_voids(Batch& batch, std::span<Contributor> rasters, std::vector<OpenPlace>& open);
  void choose_fillers(Batch& batch, std::span<Contributor> rasters, double farthest);
  Result<void> fill_from(const Filler& filler, int level, std::span<const double> spacings);
  Result<void> sample_level(HeightLayer& layer, int level, std::span<const glm::dvec2> pixels, std::span<cache::HeightSample> heights);
  std::span<const std::uint32_t> all_of(std::size_t count);

  std::shared_ptr<const SurfaceDescription> description_;
  cache::BlockCache* cache_ = nullptr;
  bool has_catalogue_ = false;
  bool reads_ = true;
  std::vector<MissingLayer>* missing_ = nullptr;
  std::unordered_map<const Layer*, HeightLayer> layers_;  ///< those of one source
  std::list<std::pair<std::uint32_t, HeightLayer>> data_sets_;  ///< open ones of catalogues by their number, the last used first
  std::unordered_map<std::uint32_t, std::list<std::pair<std::uint32_t, HeightLayer>>::iterator> data_set_index_;
  std::vector<Contributor> contributors_;  ///< to the batch at hand, lowest first
  source::FaceRegion region_;              ///< that holds it
  std::vector<std::uint32_t> found_;
  // Kept between calls: one allocation serves all batches.
  std::vector<geo::LatLon> places_;
  std::vector<geo::LatLon> inside_places_;
  std::vector<double> spacings_;
  std::vector<std::uint32_t> numbers_;
  std::vector<glm::dvec2> lattice_pixels_;
  std::unordered_map<const Layer*, LayerAnswer> answers_;
  std::vector<OpenPlace*> voids_;
  std::vector<Filler> fillers_;            ///< uppermost first
  std::vector<cache::HeightSample> fills_; ///< of the voids, by one step of levels
  std::vector<std::uint32_t> reached_;
  std::vector<std::uint32_t> void_places_;
  std::vector<glm::dvec2> void_pixels_;
  std::vector<cache::HeightSample> void_heights_;
};

/// The coarsest level of a raster whose samples are at most `wanted_spacing` metres apart; 0 if none is.
int level_for_spacing(const source::RasterDescription& raster, double wanted_spacing);

}  // namespace tellurion::surface
