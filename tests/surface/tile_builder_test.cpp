// What a vertex shader makes of a tile's vertices, and how far its triangles are from the surface.
#include "surface/tile_builder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <GeographicLib/Geocentric.hpp>
#include <glm/geometric.hpp>

#include "surface/height_field.h"
#include "surface/made_world.h"
#include "surface/rtin.h"
#include "surface/slope_map.h"
#include "surface/tile_grid.h"
#include "surface/tile_mesh.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

constexpr std::size_t kPoints = static_cast<std::size_t>(kGridSide) * kGridSide;

/// The vertex position as the shader has it, in floats, added to the origin in doubles.
glm::dvec3 shown(const TileMesh& mesh, const TileVertex& v, double exaggeration = 1.0) {
  const auto x = static_cast<float>(exaggeration);
  const auto reference = static_cast<float>(mesh.reference_height);
  const glm::vec3 up = glm::vec3(mesh.origin_up.xyz) + v.up_offset;
  const glm::vec3 local = v.base + x * (reference * v.up_offset + v.height * up);
  return mesh.origin_base.xyz + exaggeration * mesh.reference_height * mesh.origin_up.xyz + glm::dvec3(local);
}

/// Heights up to 9 km with slopes that terrain has, at any scale.
double terrain(const geo::Vector<geo::Ecef>& normal) {
  double sum = 0.0;
  const glm::dvec3 direction(0.36, 0.48, 0.8);
  for (double wave = 2e6, height = 3000; wave > 1; wave /= 7, height /= 6) {
    sum += height * std::sin(geo::kWgs84.a() * glm::dot(normal.xyz, direction) * 6.28 / wave + wave);
  }
  return std::clamp(sum + 4000, -400.0, 9000.0);
}

geo::TileKey random_key(std::mt19937_64& random, int level, int kind) {
  const auto last = static_cast<std::uint32_t>((1u << level) - 1);
  geo::TileKey key{static_cast<std::uint8_t>(random() % 6), static_cast<std::uint8_t>(level), 0, 0};
  key.x = static_cast<std::uint32_t>(random()) & last;
  key.y = static_cast<std::uint32_t>(random()) & last;
  if (kind == 1) key.x = last;                                        // a face's border
  if (kind == 2) key.x = 0, key.y = last;                             // a corner of the cube
  if (kind == 3) key.face = 4, key.x = key.y = (1u << level) / 2;     // the pole
  if (kind == 4) key.face = 2, key.x = (1u << level) / 2;             // the antimeridian
  return key;
}

struct FlatFacts : SurfaceFacts {
  std::optional<HeightError> error;
  bool slopes = false;
  TileFacts facts_of(const geo::TileKey&) const override {
    TileFacts facts;
    facts.min_height = -1e4f, facts.max_height = 1e4f;
    facts.height_error = error;
    facts.own_slopes = slopes;
    return facts;
  }
};

}  // namespace

TEST_CASE("make_tile_mesh: vertices lie within 1e-7 of the tile's size, and 1 mm up to 10 km, of their exact places") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const GeographicLib::Geocentric& earth = GeographicLib::Geocentric::WGS84();
  for (int level = 0; level <= 24; ++level) {
    for (int kind = 0; kind < 5; ++kind) {
      const geo::TileKey key = random_key(random, level, kind);
      CAPTURE(geo::to_string(key));
      const auto normals = grid_normals({key, kGridSide});
      std::vector<double> heights;
      std::transform(normals.begin(), normals.end(), std::back_inserter(heights), terrain);
      const double size = nominal_tile_size(geo::kWgs84, level);
      const DecimatedMesh built = make_tile_mesh(geo::kWgs84, key, normals, heights, heights, {size / 1e4, size / 1e4});
      const double allowed = size <= 10e3 ? std::min(1e-3, 1e-7 * size) : 1e-7 * size;
      double worst = 0;
      for (const TileVertex& v : built.mesh.vertices) {
        const auto point = static_cast<std::size_t>(std::lround(v.st.y * (kGridSide - 1)) * kGridSide + std::lround(v.st.x * (kGridSide - 1)));
        // Exact: the formula over doubles, itself held against GeographicLib where degrees are fine enough to say.
        const glm::dvec3 exact = geo::surface_point(geo::kWgs84, normals[point]).xyz + heights[point] * normals[point].xyz;
        worst = std::max(worst, glm::distance(shown(built.mesh, v), exact));
        const geo::LatLon place = geo::place_of_normal(normals[point]);
        double x = 0, y = 0, z = 0;
        earth.Forward(to_degrees(place.latitude).value, to_degrees(place.longitude).value, heights[point], x, y, z);
        REQUIRE(glm::distance(exact, glm::dvec3(x, y, z)) < 1e-8);
      }
      CHECK(worst <= allowed);
    }
  }
}

TEST_CASE("make_tile_mesh: triangles face outward, the skirt hangs from every border edge and faces away from the tile") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int kind = 0; kind < 5; ++kind) {
    const geo::TileKey key = random_key(random, 3 + kind * 3, kind);
    CAPTURE(geo::to_string(key));
    const auto normals = grid_normals({key, kGridSide});
    std::vector<double> heights;
    std::transform(normals.begin(), normals.end(), std::back_inserter(heights), terrain);
    const double size = nominal_tile_size(geo::kWgs84, key.level);
    MeshLimits one;
    one.most_steps = 1;
    const TileMesh mesh = make_tile_mesh(geo::kWgs84, key, normals, heights, heights, {size / 500, size / 500}, one).mesh;
    const auto position = [&](std::uint16_t i) {
      const TileVertex& v = mesh.vertices[i];
      return shown(mesh, v) - static_cast<double>(std::max(v.skirt, 0.0f)) * size / 10 * (mesh.origin_up.xyz + glm::dvec3(v.up_offset));
    };
    // The skirt's upper vertices lie on the surface's own.
    std::map<std::pair<float, float>, std::uint16_t> surface_at;
    for (std::uint16_t i = 0; i < mesh.vertices.size() && mesh.vertices[i].skirt == 0.0f; ++i) surface_at[{mesh.vertices[i].st.x, mesh.vertices[i].st.y}] = i;
    const auto on_surface = [&](std::uint16_t i) {
      const TileVertex& v = mesh.vertices[i];
      if (v.skirt != kSkirtTop) return i;
      const std::uint16_t there = surface_at.at({v.st.x, v.st.y});
      REQUIRE(mesh.vertices[there].base == v.base);
      REQUIRE(mesh.vertices[there].height == v.height);
      return there;
    };
    std::map<std::pair<std::uint16_t, std::uint16_t>, int> edges;
    const glm::dvec3 middle = mesh.origin_base.xyz + mesh.reference_height * mesh.origin_up.xyz;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const std::uint16_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
      const glm::dvec3 front = glm::cross(position(b) - position(a), position(c) - position(a));
      if (i < mesh.steps.front().surface_index_count) {
        REQUIRE(glm::dot(front, mesh.origin_up.xyz) > 0);
        REQUIRE((mesh.vertices[a].skirt == 0.0f && mesh.vertices[b].skirt == 0.0f && mesh.vertices[c].skirt == 0.0f));
      } else {
        const glm::dvec3 outward = position(a) - middle;
        REQUIRE(glm::dot(front, outward - glm::dot(outward, mesh.origin_up.xyz) * mesh.origin_up.xyz) > 0);
      }
      for (const auto& edge : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) ++edges[{on_surface(edge.first), on_surface(edge.second)}];
    }
    // Closed but for the rim: every edge has its twin, except those between two rim vertices.
    for (const auto& [edge, count] : edges) {
      REQUIRE(count == 1);
      const bool rim = mesh.vertices[edge.first].skirt == kSkirtRim && mesh.vertices[edge.second].skirt == kSkirtRim;
      REQUIRE(edges.contains({edge.second, edge.first}) != rim);
    }
  }
}

TEST_CASE("make_tile_mesh: the deviations it reports are those of the drawn triangles") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (const int level : {0, 2, 5, 9, 14}) {
    CAPTURE(level);
    const geo::TileKey key = random_key(random, level, level % 5);
    const auto normals = grid_normals({key, kGridSide});
    std::vector<double> heights;
    std::transform(normals.begin(), normals.end(), std::back_inserter(heights), terrain);
    const double size = nominal_tile_size(geo::kWgs84, level);
    const MeshTolerance tolerance{size / 500, size / 2000};
    const DecimatedMesh built = make_tile_mesh(geo::kWgs84, key, normals, heights, heights, tolerance);
    // Random points of the triangles: their height over the ellipsoid, against the grid's own triangulation there.
    std::uniform_real_distribution<double> share(0, 1);
    double largest = 0, largest_without_heights = 0;
    for (int i = 0; i < 20000; ++i) {
      const std::size_t t = random() % (built.mesh.steps.front().surface_index_count / 3) * 3;
      double l1 = share(random), l2 = share(random);
      if (l1 + l2 > 1) l1 = 1 - l1, l2 = 1 - l2;
      glm::dvec3 point(0), bare(0);
      const double weights[3] = {1 - l1 - l2, l1, l2};
      for (std::size_t j = 0; j < 3; ++j) {
        const TileVertex& v = built.mesh.vertices[built.mesh.indices[t + j]];
        point += weights[j] * shown(built.mesh, v);
        bare += weights[j] * (built.mesh.origin_base.xyz + glm::dvec3(v.base));
      }
      const geo::Geodetic seen = geo::to_geodetic(geo::kWgs84, {point});
      const auto uv = geo::project_to_face(key.face, geo::normal_at(geo::place_of(seen)));
      const geo::FaceRect rect = geo::face_rect(key);
      const glm::dvec2 at = glm::clamp((*uv - rect.lower) / (rect.upper - rect.lower), 0.0, 1.0) * (kGridSide - 1.0);
      largest = std::max(largest, std::abs(seen.height.value - interpolate_in_triangles(heights, kGridSide, at.x, at.y)));
      largest_without_heights = std::max(largest_without_heights, -geo::to_geodetic(geo::kWgs84, {bare}).height.value);
    }
    CHECK(largest_without_heights <= built.steps.front().curvature_deviation * 1.0001 + 1e-7);
    CHECK(largest_without_heights > 0.5 * built.steps.front().curvature_deviation - 1e-7);
    CHECK(largest <= built.steps.front().height_deviation + built.steps.front().curvature_deviation * 1.01 + 1e-6);
    if (level <= 5) CHECK(built.steps.front().curvature_deviation <= 1.5 * std::max(tolerance.curvature, size * size / (kGridSide - 1) / (kGridSide - 1) / 4 / 6.3e6));
    CHECK(built.steps.front().height_deviation <= tolerance.height + 0.05 * built.steps.front().curvature_deviation + 1e-9);
  }
}

TEST_CASE("error_between_samples: bounds the deviation of grids finer than their data, and not much too far") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  MadeRaster rough;
  rough.width = 3600, rough.height = 1800;
  rough.metres = [seed](int x, int y) { return noise(x, y, seed, 0, 2000) + noise(x / 5, y / 5, seed, 0, 8000); };
  MadeWorld world({layer_of(rough, 1)});
  std::mt19937_64 random(seed);
  std::vector<double> ratios;
  for (int i = 0; i < 60; ++i) {
    // Samples 11 km apart; grids from 9.8 km (level 4) on. Not at the poles, where columns are closer.
    const int level = 4 + i % 6;
    geo::TileKey key = random_key(random, level, 0);
    key.face %= 4;
    key.y = static_cast<std::uint32_t>((1u << level) / 4 + key.y / 2);
    CAPTURE(geo::to_string(key));
    const HeightField field = std::move(field_of_finest_data(*world.model, key)).value();
    constexpr int kDense = 4 * (kGridSide - 1) + 1;
    const auto normals = grid_normals({key, kDense});
    std::vector<double> truth(normals.size());
    REQUIRE(world.model->heights(normals, 0.0, truth));
    double largest = 0;
    for (int y = 0; y < kDense; ++y) {
      for (int x = 0; x < kDense; ++x) {
        const double grid = interpolate_in_triangles(field.heights, kGridSide, x / 4.0, y / 4.0);
        largest = std::max(largest, std::abs(truth[static_cast<std::size_t>(y * kDense + x)] - grid));
      }
    }
    REQUIRE(largest <= static_cast<double>(field.error.bound));
    ratios.push_back(static_cast<double>(field.error.bound) / largest);
  }
  std::nth_element(ratios.begin(), ratios.begin() + 30, ratios.end());
  CHECK(ratios[30] < 3);
}

TEST_CASE("build_geometry: tells the truth about its heights, in levels above and below the data's own") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  MadeRaster rough;
  rough.width = 3600, rough.height = 1800;
  rough.metres = [seed](int x, int y) { return noise(x, y, seed, 0, 500) + noise(x / 5, y / 5, seed, -4000, 4000); };
  MadeWorld world({layer_of(rough, 1)});
  FlatFacts facts;
  std::mt19937_64 random(seed);
  for (const int level : {4, 6, 9}) {
    geo::TileKey key = random_key(random, level, 0);
    key.face %= 4;
    key.y = static_cast<std::uint32_t>((1u << level) / 4 + key.y / 2);
    CAPTURE(geo::to_string(key));
    const TileGeometry built = std::move(build_geometry(*world.model, facts, key)).value();
    double largest = 0, lowest = 1e9, highest = -1e9;
    std::uniform_real_distribution<double> share(0, 1);
    for (int i = 0; i < 20000; ++i) {
      const std::size_t t = random() % (built.mesh.steps.front().surface_index_count / 3) * 3;
      double l1 = share(random), l2 = share(random);
      if (l1 + l2 > 1) l1 = 1 - l1, l2 = 1 - l2;
      glm::dvec3 point(0);
      const double weights[3] = {1 - l1 - l2, l1, l2};
      for (std::size_t j = 0; j < 3; ++j) point += weights[j] * shown(built.mesh, built.mesh.vertices[built.mesh.indices[t + j]]);
      const geo::Geodetic seen = geo::to_geodetic(geo::kWgs84, {point});
      const double truth = world.model->height_at(geo::place_of(seen), Lookup::bilinear)->metres;
      largest = std::max(largest, std::abs(seen.height.value - truth));
      lowest = std::min(lowest, truth), highest = std::max(highest, truth);
    }
    const MeshError& finest = built.metrics.steps.front();
    CHECK(largest <= static_cast<double>(finest.height.bound + finest.curvature) * 1.001);
    CHECK(largest >= 0.1 * static_cast<double>(finest.height.bound));
    CHECK(lowest >= static_cast<double>(built.metrics.min_height));
    CHECK(highest <= static_cast<double>(built.metrics.max_height));
  }
}

TEST_CASE("build_geometry: a child's parent heights are what its parent shows, along the parent's own triangles") {
  MadeRaster rough;
  rough.width = 3600, rough.height = 1800;
  rough.metres = [](int x, int y) { return noise(x, y, 7, 0, 3000); };
  MadeWorld world({layer_of(rough, 1)});
  FlatFacts facts;
  facts.error = HeightError{500.0f, 500.0f};
  const geo::TileKey parent{1, 5, 9, 17};
  const HeightField field = std::move(field_of_known_error(*world.model, parent, {500, 500})).value();
  constexpr double kHalf = (kGridSide - 1) / 2.0;
  for (int i = 0; i < 4; ++i) {
    const TileMesh mesh = std::move(build_geometry(*world.model, facts, geo::child(parent, i), {0.0, 1e-6, {}})).value().mesh;
    REQUIRE(mesh.vertices.size() > 2000);
    for (const TileVertex& v : mesh.vertices) {
      const double x = (static_cast<double>(v.st.x) + (i & 1)) * kHalf, y = (static_cast<double>(v.st.y) + (i >> 1)) * kHalf;
      const double expected = interpolate_in_triangles(field.heights, kGridSide, x, y);
      REQUIRE(static_cast<double>(v.parent_height) + mesh.reference_height == doctest::Approx(expected).epsilon(1e-5));
    }
  }
}

TEST_CASE("build_slopes: a plane's slopes are the same at every texel and those of the closed form") {
  // Heights that grow by the northing: slope 0.05 towards the north everywhere.
  MadeRaster plane;
  plane.width = 14400, plane.height = 7200;
  plane.metres = [](int, int y) { return static_cast<float>((3600 - y) * 2780.0 * 0.05); };
  MadeWorld world({layer_of(plane, 1)});
  const geo::TileKey key{0, 6, 40, 25};
  const SlopeMap map = std::move(build_slopes(*world.model, key)).value();
  REQUIRE(map.slopes.size() == kSlopeSlotSide * kSlopeSlotSide);
  for (int row = 0; row < kSlopeSlotSide; row += 9) {
    for (int column = 0; column < kSlopeSlotSide; column += 9) {
      const glm::dvec2 st((column + 0.5 - kSlopeGutter) / 124, (row + 0.5 - kSlopeGutter) / 124);
      const geo::Vector<geo::Ecef> up = geo::tile_normal(key, st);
      const glm::dvec3 tu = glm::normalize(map.tangent.xyz - glm::dot(map.tangent.xyz, up.xyz) * up.xyz);
      const glm::dvec3 tv = glm::cross(tu, up.xyz);
      const glm::dvec3 north = glm::normalize(glm::dvec3(0, 0, 1) - up.xyz.z * up.xyz);
      // Along the meridian, a degree is as long as its radius of curvature says.
      const double meridian = geo::kWgs84.a() * (1 - geo::kWgs84.e2()) / std::pow(1 - geo::kWgs84.e2() * up.xyz.z * up.xyz.z, 1.5);
      const double slope = 2780.0 * 0.05 / (meridian * kPi / 7200);
      const glm::vec2 found = map.slopes[static_cast<std::size_t>(row * kSlopeSlotSide + column)];
      CHECK(static_cast<double>(found.x) == doctest::Approx(slope * glm::dot(north, tu)).epsilon(0.002));
      CHECK(static_cast<double>(found.y) == doctest::Approx(slope * glm::dot(north, tv)).epsilon(0.002));
    }
  }
}

TEST_CASE("build_geometry: gives up when asked to") {
  MadeWorld world({});
  std::stop_source stop;
  stop.request_stop();
  const auto built = build_geometry(*world.model, FlatFacts(), {0, 3, 1, 1}, {}, stop.get_token());
  REQUIRE(!built);
  CHECK(built.error().code == ErrorCode::cancelled);
}
