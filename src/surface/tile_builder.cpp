#include "surface/tile_builder.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "surface/height_field.h"
#include "surface/outlook.h"
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

/// What the parent level's full grid shows at the grid points of its child `key`. Where the parent's data would have to be
/// fetched for that, every other of the child's own `heights` stands for them.
Result<std::vector<double>> parent_heights(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key, bool is_far,
                                           std::span<const double> own) {
  constexpr int kHalf = kCells / 2 + 1;
  std::vector<double> coarse(static_cast<std::size_t>(kHalf) * kHalf);
  if (is_far) {
    coarse = every_other(own, kGridSide);
  } else {
    const double spacing = wanted_spacing(facts, model.description().ellipsoid, geo::parent(key));
    if (Result<void> read = model.heights(TileLattice{key, kHalf}, spacing, coarse); !read) return read.error();
  }
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
HeightError error_of_ancestors(const SurfaceFacts& facts, geo::TileKey key) {
  while (key.level > 0) {
    key = geo::parent(key);
    if (const std::optional<HeightError> error = facts.facts_of(key).height_error) return *error;
  }
  return {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
}

/// Of a triangulation of the field.
HeightError error_of_step(const HeightField& field, const DecimatedStep& step) {
  DeviationTally tally;
  for (std::size_t i = 0; i < step.drawn.size(); ++i) tally.add(std::abs(step.drawn[i] - field.heights[i]));
  const double sideways = step.sideways_deviation;
  const HeightError added{field.error.bound + static_cast<float>(step.height_deviation),
                          field.error.common + static_cast<float>(tally.common() + sideways)};
  if (field.finest.half_steps.empty()) return added;
  const HeightError measured = field.finest.deviation_of(step.drawn);
  return {std::min(added.bound, measured.bound + static_cast<float>(sideways)), measured.common + static_cast<float>(sideways)};
}

}  // namespace

Result<TileGeometry> build_geometry(ElevationModel& model, const SurfaceFacts& facts, const geo::TileKey& key,
                                    const MeshSettings& settings, std::stop_token stop) {
  const TileFacts known = facts.facts_of(key);
  Result<HeightField> field = known.height_error ? field_of_known_error(model, key, *known.height_error) : field_of_finest_data(model, key);
  if (!field) return field.error();
  if (!known.height_error) {
    const HeightError above = error_of_ancestors(facts, key);
    field->error = {std::min(field->error.bound, above.bound), std::min(field->error.common, above.common)};
  }
  if (stop.stop_requested()) return Error{ErrorCode::cancelled, "geometry of " + geo::to_string(key)};

  std::shared_ptr<const Outlook> outlook;
  if (known.assumed) {
    Foretold foretold = foretell(field->heights);
    if (known.height_error) {
      field->error = foretold.error;
      field->judged_error = static_cast<double>(judged(foretold.error));
    }
    outlook = std::make_shared<const Outlook>(std::move(foretold.outlook));
  }

  std::vector<double> parents = field->heights;
  if (key.level > 0) {
    Result<std::vector<double>> coarse = parent_heights(model, facts, key, known.assumed, field->heights);
    if (!coarse) return coarse.error();
    parents = std::move(coarse).value();
  }

  SlopeMap slopes;
  if (known.own_slopes) {
    Result<SlopeMap> built = build_slopes(model, key, stop);
    if (!built) return built.error();
    slopes = std::move(built).value();
  }
  // All has been asked for; what follows would be thrown away.
  if (model.is_pending()) return Error{ErrorCode::pending, "geometry of " + geo::to_string(key)};

  const geo::Ellipsoid& ellipsoid = model.description().ellipsoid;
  const double least = settings.of_tile_size * nominal_tile_size(ellipsoid, key.level);
  const MeshTolerance tolerance{std::max(settings.of_grid_error * field->judged_error, least), least};
  DecimatedMesh decimated = make_tile_mesh(ellipsoid, key, field->normals, field->heights, parents, tolerance, settings.limits);

  TileGeometry geometry;
  geometry.metrics.outlook = std::move(outlook);
  geometry.mesh = std::move(decimated.mesh);
  geometry.metrics.mesh_bytes = static_cast<std::uint32_t>(geometry.mesh.bytes());
  geometry.metrics.step_count = static_cast<std::uint8_t>(decimated.steps.size());
  for (std::size_t i = 0; i < decimated.steps.size(); ++i) {
    geometry.metrics.steps[i] = {error_of_step(*field, decimated.steps[i]), static_cast<float>(decimated.steps[i].curvature_deviation)};
  }
  const auto [lowest, highest] = std::minmax_element(field->heights.begin(), field->heights.end());
  // The drawn heights, and the true ones: as the facts have them or within the error of those drawn.
  geometry.metrics.min_height = static_cast<float>(std::min(*lowest, std::max(*lowest - static_cast<double>(field->error.bound), double{known.min_height})));
  geometry.metrics.max_height = static_cast<float>(std::max(*highest, std::min(*highest + static_cast<double>(field->error.bound), double{known.max_height})));
  geometry.slopes = std::move(slopes);
  return geometry;
}

}  // namespace tellurion::surface
