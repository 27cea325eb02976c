// Terrain tiles of the format quantized-mesh 1.0: triangles over a rectangle of longitude and latitude.
// Thread-safe: pure functions.
// Format: github.com/CesiumGS/quantized-mesh
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "raster/height_grid.h"

namespace tellurion::raster {

/// Each from 0 to QuantizedMesh::kMost.
struct MeshVertex {
  std::uint16_t u = 0;       ///< west to east
  std::uint16_t v = 0;       ///< south to north; evenly in latitude, whatever the map's projection
  std::uint16_t height = 0;  ///< lowest to highest
};

struct QuantizedMesh {
  static constexpr int kMost = 32767;
  double lowest = 0.0;   ///< metres above the ellipsoid
  double highest = 0.0;
  std::vector<MeshVertex> vertices;
  std::vector<std::uint32_t> triangles;  ///< three vertices each; all of them are there
};

/// Reads a tile, gzipped or not. The edges' vertices are checked; extensions (normals, water, metadata) are passed over.
/// Errors: corrupt, exhausted (more than a million vertices or two million triangles); messages say what is wrong, not where.
Result<QuantizedMesh> decode_quantized_mesh(std::string_view bytes);

/// Heights at the centres of `width` columns, evenly from west to east, and of rows at the latitudes `rows`, as shares of the way
/// from the south edge (0) to the north edge (1): the mesh's flat triangles, exactly, in metres above the ellipsoid. A place on an
/// edge belongs to both triangles, so that a whole mesh leaves no gap; what no triangle covers is void.
/// Errors: corrupt (triangles that lie over one another many times). Requires 1 to 4096 columns and rows (asserted).
Result<HeightGrid> rasterise(const QuantizedMesh& mesh, int width, std::span<const double> rows);

/// The rows of a tile whose pixels are evenly spaced in latitude, from the north.
std::vector<double> even_rows(int count);

}  // namespace tellurion::raster
