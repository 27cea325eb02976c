#include "raster/quantized_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>

#include <fmt/format.h>

#include "base/gzip.h"

namespace tellurion::raster {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers in tiles are little-endian and copied as they are");

constexpr std::size_t kMostBytes = std::size_t{64} << 20;  ///< unpacked
constexpr std::uint32_t kMostVertices = 1 << 20;
constexpr std::uint32_t kMostTriangles = 1 << 21;
constexpr std::size_t kCentreBytes = 3 * 8;           ///< before the lowest height: the tile's centre
constexpr std::size_t kSphereAndHorizonBytes = 7 * 8; ///< after the highest: bounding sphere, horizon occlusion point

Error too_short() { return {ErrorCode::corrupt, "is a quantized mesh that ends too early"}; }

/// Takes numbers off the front of bytes.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes), total_(bytes.size()) {}

  std::size_t left() const { return rest_.size(); }

  bool skip(std::size_t count) {
    if (count > rest_.size()) return false;
    rest_.remove_prefix(count);
    return true;
  }

  /// So that the next number lies at a multiple of `size` from the start.
  bool align(std::size_t size) { return skip((size - (total_ - rest_.size()) % size) % size); }

  template <class Number>
  bool take(Number& number) {
    if (rest_.size() < sizeof(Number)) return false;
    std::memcpy(&number, rest_.data(), sizeof(Number));
    rest_.remove_prefix(sizeof(Number));
    return true;
  }

  template <class Number>
  bool take(std::vector<Number>& numbers, std::size_t count) {
    if (rest_.size() / sizeof(Number) < count) return false;
    numbers.resize(count);
    if (count > 0) std::memcpy(numbers.data(), rest_.data(), count * sizeof(Number));
    rest_.remove_prefix(count * sizeof(Number));
    return true;
  }

 private:
  std::string_view rest_;
  std::size_t total_;
};

/// One of a vertex's three numbers, for all vertices: differences from vertex to vertex, zig-zag coded.
Result<void> take_component(ByteReader& reader, std::vector<MeshVertex>& vertices, std::uint16_t MeshVertex::* component) {
  std::vector<std::uint16_t> coded;
  if (!reader.take(coded, vertices.size())) return too_short();
  int value = 0;
  for (std::size_t i = 0; i < coded.size(); ++i) {
    value += (coded[i] >> 1) ^ -(coded[i] & 1);
    if (value < 0 || value > QuantizedMesh::kMost) return Error{ErrorCode::corrupt, fmt::format("is a quantized mesh whose vertex {} lies outside of the tile", i)};
    vertices[i].*component = static_cast<std::uint16_t>(value);
  }
  return {};
}

template <class Index>
Result<void> take_triangles(ByteReader& reader, std::size_t count, std::size_t vertex_count, std::vector<std::uint32_t>& triangles) {
  std::vector<Index> coded;
  if (!reader.take(coded, count * 3)) return too_short();
  triangles.resize(coded.size());
  std::uint32_t next = 0;  // the first vertex not used yet: indices count down from it
  for (std::size_t i = 0; i < coded.size(); ++i) {
    if (coded[i] > next) return Error{ErrorCode::corrupt, "is a quantized mesh with triangles of vertices that do not exist"};
    triangles[i] = next - coded[i];
    if (coded[i] == 0) ++next;
    if (triangles[i] >= vertex_count) return Error{ErrorCode::corrupt, "is a quantized mesh with triangles of vertices that do not exist"};
  }
  return {};
}

template <class Index>
Result<void> check_edges(ByteReader& reader, std::size_t vertex_count) {
  for (int edge = 0; edge < 4; ++edge) {
    std::uint32_t count = 0;
    std::vector<Index> vertices;
    if (!reader.take(count) || !reader.take(vertices, count)) return too_short();
    if (std::any_of(vertices.begin(), vertices.end(), [&](Index vertex) { return vertex >= vertex_count; }))
      return Error{ErrorCode::corrupt, "is a quantized mesh with edges of vertices that do not exist"};
  }
  return {};
}

template <class Index>
Result<void> take_indices(ByteReader& reader, QuantizedMesh& mesh) {
  std::uint32_t count = 0;
  if (!reader.align(sizeof(Index)) || !reader.take(count)) return too_short();
  if (count > kMostTriangles) return Error{ErrorCode::exhausted, fmt::format("is a quantized mesh of {} triangles", count)};
  if (const auto taken = take_triangles<Index>(reader, count, mesh.vertices.size(), mesh.triangles); !taken) return taken;
  return check_edges<Index>(reader, mesh.vertices.size());
}

Result<QuantizedMesh> decode_plain(std::string_view bytes) {
  ByteReader reader(bytes);
  QuantizedMesh mesh;
  float lowest = 0, highest = 0;
  std::uint32_t count = 0;
  if (!reader.skip(kCentreBytes) || !reader.take(lowest) || !reader.take(highest) || !reader.skip(kSphereAndHorizonBytes) || !reader.take(count))
    return too_short();
  if (!std::isfinite(lowest) || !std::isfinite(highest) || lowest > highest)
    return Error{ErrorCode::corrupt, fmt::format("is no quantized mesh: its heights would go from {} to {} m", lowest, highest)};
  if (count > kMostVertices) return Error{ErrorCode::exhausted, fmt::format("is a quantized mesh of {} vertices", count)};
  if (reader.left() / 6 < count) return too_short();
  mesh.lowest = static_cast<double>(lowest);
  mesh.highest = static_cast<double>(highest);
  mesh.vertices.resize(count);
  for (const auto component : {&MeshVertex::u, &MeshVertex::v, &MeshVertex::height}) {
    if (const auto taken = take_component(reader, mesh.vertices, component); !taken) return taken.error();
  }
  constexpr std::uint32_t kMostWithShortIndices = 65536;
  const auto indices = count > kMostWithShortIndices ? take_indices<std::uint32_t>(reader, mesh) : take_indices<std::uint16_t>(reader, mesh);
  if (!indices) return indices.error();
  while (reader.left() > 0) {
    std::uint8_t extension = 0;
    std::uint32_t length = 0;
    if (!reader.take(extension) || !reader.take(length) || !reader.skip(length)) return too_short();
  }
  return mesh;
}

}  // namespace

Result<QuantizedMesh> decode_quantized_mesh(std::string_view bytes) {
  if (!is_gzip(bytes)) return decode_plain(bytes);
  const Result<std::string> unpacked = gunzip(bytes, kMostBytes);
  if (unpacked) return decode_plain(*unpacked);
  // One tile of 16 million begins with gzip's three bytes by chance.
  Result<QuantizedMesh> plain = decode_plain(bytes);
  return plain ? std::move(plain) : Result<QuantizedMesh>(unpacked.error());
}

// --- Rasterising -----------------------------------------------------------------------------------------------------
// In integers, so that the two triangles at an edge agree on which side a place lies.

namespace {

constexpr std::int64_t kUnits = 4096;  ///< per step of u and v
constexpr std::int64_t kSpan = kUnits * QuantizedMesh::kMost;
constexpr int kLargestSide = 4096;

struct Corner {
  std::int64_t x, y;  ///< in units, from the south west
  int height;
};

/// Twice the area of the triangle a, b, c: positive if it is counter-clockwise. Below 2^56.
std::int64_t doubled_area(const Corner& a, const Corner& b, std::int64_t x, std::int64_t y) { return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x); }

class MeshRaster {
 public:
  MeshRaster(const QuantizedMesh& mesh, int width, std::span<const double> rows)
      : mesh_(mesh), grid_{width, static_cast<int>(rows.size()), std::vector<float>(static_cast<std::size_t>(width) * rows.size(), kNoHeight)} {
    for (int i = 0; i < width; ++i) xs_.push_back(std::llround((i + 0.5) / width * static_cast<double>(kSpan)));
    // From the south, so that both axes ascend.
    for (std::size_t j = rows.size(); j-- > 0;) ys_.push_back(std::llround(std::clamp(rows[j], 0.0, 1.0) * static_cast<double>(kSpan)));
    // A whole mesh covers each pixel once; thin triangles pass many rows.
    steps_left_ = 16 * static_cast<std::int64_t>(grid_.metres.size()) + 64 * static_cast<std::int64_t>(mesh.triangles.size());
  }

  Result<HeightGrid> draw() {
    for (std::size_t i = 0; i + 2 < mesh_.triangles.size(); i += 3) {
      draw({corner(mesh_.triangles[i]), corner(mesh_.triangles[i + 1]), corner(mesh_.triangles[i + 2])});
      if (steps_left_ < 0) return Error{ErrorCode::corrupt, "is a quantized mesh whose triangles lie over one another"};
    }
    return std::move(grid_);
  }

 private:
  Corner corner(std::uint32_t index) const {
    const MeshVertex& vertex = mesh_.vertices[index];
    return {vertex.u * kUnits, vertex.v * kUnits, vertex.height};
  }

  void draw(std::array<Corner, 3> corners) {
    std::int64_t area = doubled_area(corners[0], corners[1], corners[2].x, corners[2].y);
    if (area == 0) return;
    if (area < 0) {
      std::swap(corners[1], corners[2]);
      area = -area;
    }
    const auto [south, north] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
    const auto end = std::upper_bound(ys_.begin(), ys_.end(), north);
    for (auto y = std::lower_bound(ys_.begin(), ys_.end(), south); y < end; ++y) draw_row(corners, area, static_cast<std::size_t>(y - ys_.begin()));
  }

  /// Where the row runs through the triangle, rounded outwards; the sides decide.
  void draw_row(const std::array<Corner, 3>& corners, std::int64_t area, std::size_t row) {
    const std::int64_t y = ys_[row];
    double west = static_cast<double>(kSpan), east = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Corner &a = corners[i], &b = corners[(i + 1) % 3];
      if (y < std::min(a.y, b.y) || y > std::max(a.y, b.y)) continue;
      const double share = a.y == b.y ? 0.0 : static_cast<double>(y - a.y) / static_cast<double>(b.y - a.y);
      const double x = static_cast<double>(a.x) + share * static_cast<double>(b.x - a.x);
      west = std::min({west, x, a.y == b.y ? static_cast<double>(b.x) : x});
      east = std::max({east, x, a.y == b.y ? static_cast<double>(b.x) : x});
    }
    const int width = grid_.width;
    const double columns_per_unit = width / static_cast<double>(kSpan);
    const int first = std::clamp(static_cast<int>(std::floor(west * columns_per_unit - 0.5)), 0, width - 1);
    const int last = std::clamp(static_cast<int>(std::ceil(east * columns_per_unit - 0.5)), 0, width - 1);
    steps_left_ -= last - first + 1;
    for (int i = first; i <= last; ++i) {
      const std::int64_t x = xs_[static_cast<std::size_t>(i)];
      const std::array<std::int64_t, 3> shares{doubled_area(corners[1], corners[2], x, y), doubled_area(corners[2], corners[0], x, y),
                                               doubled_area(corners[0], corners[1], x, y)};
      if (std::any_of(shares.begin(), shares.end(), [](std::int64_t share) { return share < 0; })) continue;
      double height = 0.0;
      for (std::size_t k = 0; k < 3; ++k) height += static_cast<double>(shares[k]) * corners[k].height;
      height /= static_cast<double>(area) * QuantizedMesh::kMost;
      grid_.at(i, grid_.height - 1 - static_cast<int>(row)) = static_cast<float>(mesh_.lowest + height * (mesh_.highest - mesh_.lowest));
    }
  }

  const QuantizedMesh& mesh_;
  HeightGrid grid_;
  std::vector<std::int64_t> xs_, ys_;  ///< of the columns' and rows' centres, ascending
  std::int64_t steps_left_ = 0;
};

}  // namespace

Result<HeightGrid> rasterise(const QuantizedMesh& mesh, int width, std::span<const double> rows) {
  assert(width >= 1 && width <= kLargestSide && !rows.empty() && rows.size() <= static_cast<std::size_t>(kLargestSide));
  return MeshRaster(mesh, width, rows).draw();
}

std::vector<double> even_rows(int count) {
  std::vector<double> rows;
  for (int j = 0; j < count; ++j) rows.push_back(1.0 - (j + 0.5) / count);
  return rows;
}

}  // namespace tellurion::raster
