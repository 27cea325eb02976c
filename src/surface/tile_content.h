// What a worker builds for a surface tile: geometry and imagery, ready to upload, and the numbers that the cut needs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "base/result.h"
#include "geo/frames.h"
#include "geo/tile_key.h"
#include "raster/image.h"
#include "surface/height_error.h"

namespace tellurion::surface {

inline constexpr int kGridSide = 129;          ///< height samples along a tile's side
inline constexpr int kColourSlotSide = 256;    ///< texels of a colour slot along a side, gutters included
inline constexpr int kColourGutter = 4;        ///< texels of it beyond each border of the tile
inline constexpr int kSlopeSlotSide = 128;
inline constexpr int kSlopeGutter = 2;

inline constexpr int kMostMeshSteps = 6;       ///< triangulations of a tile

/// How far one triangulation of a tile is from the truth.
struct MeshError {
  HeightError height;   ///< of the drawn heights, against the finest data under the tile
  float curvature = 0;  ///< largest deviation that comes from the body's curvature alone, metres
};

inline constexpr int kOutlookLevels = 3;       ///< a tile tells of its descendants so many levels down

/// What a tile's grid says of its descendants where no table does: foretold from its own roughness.
struct Outlook {
  struct Block {
    float min_height = 0;  ///< metres above the ellipsoid, what the grid does not show included
    float max_height = 0;
    HeightError error;     ///< of a descendant's full grid
  };
  /// Of the children, their children and so on: 4 + 16 + 64, each level row by row (v, then u).
  std::array<Block, 84> blocks{};

  /// That of `descendant` of `tile`, or of its ancestor kOutlookLevels below `tile` if it lies deeper.
  const Block& of(const geo::TileKey& tile, geo::TileKey descendant) const;
};

/// Numbers that decide whether a tile is good enough.
struct TileMetrics {
  float min_height = 0;  ///< metres above the ellipsoid, of the true and of the drawn surface
  float max_height = 0;
  std::array<MeshError, kMostMeshSteps> steps{};  ///< of the mesh's steps, finest first
  std::uint8_t step_count = 1;
  std::uint32_t mesh_bytes = 96u << 10;
  std::shared_ptr<const Outlook> outlook{};  ///< where facts only assume
};

inline constexpr float kSkirtTop = -1.0f;      ///< the upper border of the skirt, where it meets the surface
inline constexpr float kSkirtRim = 1.0f;       ///< and the lower one

/// One vertex. Position relative to the mesh's origin at exaggeration x, in Ecef axes, where
/// up = origin_up + up_offset:
///   base + x * (reference_height * up_offset + height * up) - max(skirt, 0) * skirt_depth * (up - lean)
/// with lean a small outward step (see the shader). `morph` mixes parent_height (0) and height (1).
/// The whole skirt is taken to be skirt_depth farther away than it is: seen edge-on its depth is hardly known, and it must not
/// win over a neighbour that it touches.
struct TileVertex {
  glm::vec3 base;         ///< point of the bare ellipsoid minus origin's point of the bare ellipsoid, metres
  glm::vec3 up_offset;    ///< ellipsoid normal minus origin_up
  float height;           ///< metres above reference_height
  float parent_height;    ///< the same as the parent level shows it here
  glm::vec2 st;           ///< tile coordinates in [0, 1]^2, (0, 0) = lowest u and v
  float skirt;            ///< 0 on the surface, kSkirtTop or kSkirtRim
};

/// One triangulation out of a mesh's vertices: a range of its indices, the surface's triangles first, then the skirt's.
struct MeshStep {
  std::uint32_t first_index = 0;
  std::uint32_t surface_index_count = 0;
  std::uint32_t index_count = 0;
};

/// A tile's triangles, counter-clockwise seen from outside.
struct TileMesh {
  geo::Point<geo::Ecef> origin_base;   ///< the tile centre's point of the bare ellipsoid
  geo::Vector<geo::Ecef> origin_up;    ///< unit normal there
  double reference_height = 0;         ///< metres; the origin at exaggeration x is origin_base + x * reference_height * origin_up
  std::vector<TileVertex> vertices;    ///< surface first, then the skirt's
  std::vector<std::uint16_t> indices;
  std::vector<MeshStep> steps;         ///< from the finest to the coarsest, 1 to kMostMeshSteps of them

  std::size_t bytes() const { return vertices.size() * sizeof(TileVertex) + indices.size() * sizeof(std::uint16_t); }
};

/// Slopes of the elevation for shading, finer than the mesh: kSlopeSlotSide^2 texels, gutters included, row 0 = lowest v.
/// (dh/ds, dh/dt): metres of height per metre of ground along the tangent T_u and T_v at the texel, where T_u is `tangent`
/// made orthogonal to the local up and normalised, and T_v = cross(T_u, up) (both are right-handed with row order: T_v points
/// to growing t). The shading normal at exaggeration x is normalize(up - x * (ds * T_u + dt * T_v)).
struct SlopeMap {
  geo::Vector<geo::Ecef> tangent;      ///< unit vector at the tile's centre along growing s
  std::vector<glm::vec2> slopes;       ///< empty: use the parent's
};

/// A layer, or a raster of a catalogue, that could not be read: the tile is composed of the others.
struct MissingLayer {
  std::uint32_t source_id = 0;
  Error error;
};

struct TileGeometry {
  TileMesh mesh;
  SlopeMap slopes;
  TileMetrics metrics;
  std::vector<MissingLayer> missing{};
};

/// What an image layer tells of the ground: its colour by day; its brightness, which takes the place of the colours' own; the light
/// that it gives by night; where there is water; something that lies over ground and air and that no light changes; or how it is inclined:
/// the unit normal in the frame of east, north and up, (n + 1) / 2 as red, green and blue.
enum class ImageUse : std::uint8_t { colour, grayscale, night, water, overlay, normal };
inline constexpr std::size_t kImageUses = 6;

inline constexpr float kUnbounded = 1e4f;  ///< as a limit of texture coordinates: none

/// A piece of a source image to be drawn into a tile's colour slot, lowest layer first.
/// The control points form a grid of (columns + 1) x (rows + 1) over the slot's tile coordinates from `lower` to `upper`.
struct ImagePatch {
  raster::Image image;                  ///< a window of one level of the source
  int columns = 0;
  int rows = 0;
  glm::vec2 lower{0.0f};                ///< tile coordinates st of the first control point
  glm::vec2 upper{1.0f};
  std::vector<glm::vec2> image_points;  ///< texture coordinates in `image` ([0, 1] = whole window), row by row
  /// Texture coordinates between which the raster has pixels. Its border is repeated beyond them and fades out over one of its pixels, or
  /// one texel of the slot if that is larger: two rasters that end on one line leave no gap and no step.
  glm::vec2 data_lower{-kUnbounded};
  glm::vec2 data_upper{kUnbounded};
  glm::vec2 data_pixel{0.0f};           ///< size of the raster's pixels there
  glm::vec2 feather{0.0f};              ///< not 0: it fades inwards from there instead, over so much (or a texel if that is larger)
  bool opaque = false;                  ///< covers its whole rectangle with alpha 1
  bool linear = true;                   ///< bilinear filtering; else nearest
  float opacity = 1.0f;
  float gamma = 1.0f;
  float multiplier = 1.0f;
  ImageUse use = ImageUse::colour;
};

struct TileImagery {
  std::vector<ImagePatch> patches;   ///< of colour and grayscale
  /// Of night and water, for a slot of their own. None of a use of which the tile has nothing: neither light nor water.
  std::vector<ImagePatch> effects;
  std::vector<ImagePatch> overlays;  ///< for one more slot
  std::vector<ImagePatch> normals;   ///< likewise
  float normals_spacing = 0;         ///< metres between the finest of them
  std::vector<MissingLayer> missing;
  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto* list : {&patches, &effects, &overlays, &normals}) {
      for (const ImagePatch& p : *list) sum += p.image.bytes() + p.image_points.size() * sizeof(glm::vec2);
    }
    return sum;
  }
};

}  // namespace tellurion::surface
