#include "surface/tile_builder.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "surface/height_field.h"
#include "surface/rtin.h"
#include "surface/slope_map.h"
#include "surface/tile_grid.h"
#include "surface/tile_mesh.h"

namespace tellurion::surface {
namespace {

constexpr int kCells = kGridSide - 1;

/// The height samples that a tile's grid is made of are as far apart as the grid itself while its error is known from the
/// finest data; below that they are the finest there are.
double wanted_spacing(const SurfaceFacts& facts, const geo::Ellipsoid& ellipsoid, const geo::TileKey& key) {
  return facts.facts_of(key).height_error ? nominal_grid_spacing(ellipsoid, key.level) : 0.0;
}

/// What the parent level's full grid shows at the grid points of its child `key`.
Result<std::vector<double>> parent_heights(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key) {
  constexpr int kHalf = kCells / 2 + 1;
  const std::vector<geo::Vector<geo::Ecef>> normals = grid_normals(key, kHalf);
  std::vector<double> coarse(normals.size());
  const double spacing = wanted_spacing(facts, model.description().ellipsoid, geo::parent(key));
  if (Result<void> read = model.heights(normals, spacing, coarse); !read) return read.error();
  // A child begins at an even column and row of its parent's grid, so both split their cells alike.
  std::vector<double> heights;
  heights.reserve(static_cast<std::size_t>(kGridSide) * static_cast<std::size_t>(kGridSide));
  for (int row = 0; row < kGridSide; ++row) {
    for (int column = 0; column < kGridSide; ++column) {
      heights.push_back(interpolate_in_triangles(coarse, kHalf, column / 2.0, row / 2.0));
    }
  }
  return heights;
}

/// The error of the nearest ancestor for which it is known: nothing below can be worse.
double error_of_ancestors(const SurfaceFacts& facts, geo::TileKey key) {
  while (key.level > 0) {
    key = geo::parent(key);
    if (const std::optional<float> error = facts.facts_of(key).height_error) return static_cast<double>(*error);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

Result<TileGeometry> build_geometry(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key,
                                    double parent_error, const MeshSettings& settings, std::stop_token stop) {
  const TileFacts known = facts.facts_of(key);
  Result<HeightField> field =
      known.height_error ? field_of_known_error(model, key, static_cast<double>(*known.height_error)) : field_of_finest_data(model, key);
  if (!field) return field.error();
  if (!known.height_error) field->error = std::min(field->error, error_of_ancestors(facts, key));
  if (stop.stop_requested()) return Error{ErrorCode::cancelled, "geometry of " + geo::to_string(key)};

  std::vector<double> parents = field->heights;
  if (key.level > 0) {
    Result<std::vector<double>> coarse = parent_heights(model, facts, key);
    if (!coarse) return coarse.error();
    parents = std::move(coarse).value();
  }

  const geo::Ellipsoid& ellipsoid = model.description().ellipsoid;
  const double least = settings.of_tile_size * nominal_tile_size(ellipsoid, key.level);
  const double of_parent = std::min(settings.of_parent_error * parent_error - field->error, 4.0 * least);
  const MeshTolerance tolerance{std::max({settings.of_grid_error * field->error, of_parent, least}), least};
  DecimatedMesh decimated = make_tile_mesh(ellipsoid, key, field->normals, field->heights, parents, tolerance);

  TileGeometry geometry;
  geometry.mesh = std::move(decimated.mesh);
  double error = field->error + decimated.height_deviation;
  if (!known.height_error) {
    const Result<double> measured = measured_error(model, key, decimated.drawn, field->fine);
    if (!measured) return measured.error();
    error = std::min(error, *measured + decimated.sideways_deviation);
  }
  geometry.metrics.height_error = static_cast<float>(error);
  geometry.metrics.curvature_error = static_cast<float>(decimated.curvature_deviation);
  const auto [lowest, highest] = std::minmax_element(field->heights.begin(), field->heights.end());
  // The drawn heights, and the true ones: as the facts have them or within the error of those drawn.
  geometry.metrics.min_height = static_cast<float>(std::min(*lowest, std::max(*lowest - field->error, double{known.min_height})));
  geometry.metrics.max_height = static_cast<float>(std::max(*highest, std::min(*highest + field->error, double{known.max_height})));
  if (known.own_slopes) {
    Result<SlopeMap> slopes = build_slopes(model, key, stop);
    if (!slopes) return slopes.error();
    geometry.slopes = std::move(slopes).value();
  }
  return geometry;
}

}  // namespace tellurion::surface
