// A planet of exact tiles, made without the surface room: the ellipsoid or any heights over it, in double precision.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include "geo/ellipsoid.h"
#include "geo/tile_key.h"
#include "render/renderer.h"
#include "surface/draw_list.h"
#include "surface/tile_content.h"

namespace tellurion::render::test {

using HeightFunction = std::function<double(const geo::Vector<geo::Ecef>& normal)>;
using ColourFunction = std::function<glm::dvec3(const geo::Vector<geo::Ecef>& normal)>;  // encoded, [0, 1]

inline constexpr int kCells = 64;  ///< of a test tile's grid, along a side

/// The tile's grid of 65 x 65 points at `height`, as surface::TileVertex defines it.
inline surface::TileGeometry exact_geometry(const geo::Ellipsoid& ellipsoid, const geo::TileKey& key,
                                            const HeightFunction& height) {
  surface::TileGeometry geometry;
  surface::TileMesh& mesh = geometry.mesh;
  mesh.origin_up = geo::tile_normal(key, {0.5, 0.5});
  mesh.origin_base = geo::surface_point(ellipsoid, mesh.origin_up);
  mesh.reference_height = height(mesh.origin_up);
  for (int row = 0; row <= kCells; ++row) {
    for (int column = 0; column <= kCells; ++column) {
      const glm::dvec2 st(static_cast<double>(column) / kCells, static_cast<double>(row) / kCells);
      const auto normal = geo::tile_normal(key, st);
      surface::TileVertex v{};
      v.base = glm::vec3((geo::surface_point(ellipsoid, normal) - mesh.origin_base).xyz);
      v.up_offset = glm::vec3((normal - mesh.origin_up).xyz);
      v.height = v.parent_height = static_cast<float>(height(normal) - mesh.reference_height);
      v.st = glm::vec2(st);
      mesh.vertices.push_back(v);
    }
  }
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const int a = row * (kCells + 1) + column;
      const int b = a + kCells + 1;
      for (const int i : {a, b, a + 1, a + 1, b, b + 1}) mesh.indices.push_back(static_cast<std::uint16_t>(i));
    }
  }
  const auto count = static_cast<std::uint32_t>(mesh.indices.size());
  mesh.steps = {{0, count, count}};
  const double step = 1e-3;
  const auto along = geo::tile_normal(key, {0.5 + step, 0.5}) - geo::tile_normal(key, {0.5 - step, 0.5});
  geometry.slopes.tangent = {glm::normalize(along.xyz)};
  return geometry;
}

/// One opaque patch over the whole slot, gutter included: an image of `side`, sampled at its texels' centres.
inline surface::TileImagery exact_imagery(const geo::TileKey& key, const ColourFunction& colour,
                                          int side = surface::kColourSlotSide) {
  constexpr double kInner = surface::kColourSlotSide - 2 * surface::kColourGutter;
  const double step = static_cast<double>(surface::kColourSlotSide) / side;
  surface::ImagePatch patch;
  patch.image = {side, side, {}};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const glm::dvec2 st(((x + 0.5) * step - surface::kColourGutter) / kInner,
                          ((y + 0.5) * step - surface::kColourGutter) / kInner);
      const glm::dvec3 c = colour(geo::tile_normal(key, st));
      for (int i = 0; i < 3; ++i) patch.image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255.0 * c[i])));
      patch.image.rgba.push_back(255);
    }
  }
  patch.columns = patch.rows = 1;
  patch.lower = glm::vec2(static_cast<float>(-surface::kColourGutter / kInner));
  patch.upper = glm::vec2(static_cast<float>(1.0 + surface::kColourGutter / kInner));
  patch.image_points = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  patch.opaque = true;
  surface::TileImagery imagery;
  imagery.patches.push_back(std::move(patch));
  return imagery;
}

/// Draws a tile with its own slots.
inline surface::DrawTile draw_alone(const geo::TileKey& key) {
  return {.key = key, .colour_owner = key, .colour_before = key, .slope_owner = key};
}

/// All tiles of a level.
inline std::vector<geo::TileKey> tiles_of_level(int level) {
  std::vector<geo::TileKey> keys;
  for (std::uint8_t face = 0; face < geo::kFaceCount; ++face)
    for (std::uint32_t y = 0; y < 1u << level; ++y)
      for (std::uint32_t x = 0; x < 1u << level; ++x) keys.push_back({face, static_cast<std::uint8_t>(level), x, y});
  return keys;
}

/// Uploads all of a level and returns what to draw.
inline std::vector<surface::DrawTile> upload_level(gpu::RenderThread& thread, Renderer& renderer,
                                                   const geo::Ellipsoid& ellipsoid, int level, const HeightFunction& height,
                                                   const ColourFunction& colour,
                                                   int image_side = surface::kColourSlotSide) {
  std::vector<surface::DrawTile> tiles;
  for (const geo::TileKey& key : tiles_of_level(level)) {
    REQUIRE(renderer.upload_geometry(thread, key, exact_geometry(ellipsoid, key, height)));
    REQUIRE(renderer.upload_colour(thread, key, exact_imagery(key, colour, image_side)));
    tiles.push_back(draw_alone(key));
  }
  return tiles;
}

/// Squares of ten degrees, light and dark, tinted by hemisphere.
inline glm::dvec3 checker(const geo::Vector<geo::Ecef>& normal) {
  const geo::LatLon place = geo::place_of_normal(normal);
  const int row = static_cast<int>(std::floor(to_degrees(place.latitude).value / 10.0));
  const int column = static_cast<int>(std::floor(to_degrees(place.longitude).value / 10.0));
  const double shade = (row + column) % 2 == 0 ? 0.75 : 0.35;
  return {shade, shade * (normal.xyz.z > 0 ? 1.0 : 0.6), shade * (normal.xyz.y > 0 ? 0.5 : 0.9)};
}

inline double flat(const geo::Vector<geo::Ecef>&) { return 0.0; }

}  // namespace tellurion::render::test
