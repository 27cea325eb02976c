// Quantized-mesh tiles made for tests, after the format's description.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace tellurion::test {

struct MadeMesh {
  float lowest = 0;
  float highest = 32767;
  std::vector<std::array<int, 3>> vertices;             ///< u, v, height
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::string extensions{};
};

template <class Number>
void append(std::string& bytes, Number number) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

/// One index of a list by "high water mark": how far it lies below the next new vertex.
template <class Index>
void append_indices(std::string& bytes, const MadeMesh& mesh) {
  while (bytes.size() % sizeof(Index) != 0) bytes.push_back('\0');
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  std::uint32_t mark = 0;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) {
      append(bytes, static_cast<Index>(mark - index));
      if (index == mark) ++mark;
    }
  }
  for (int edge = 0; edge < 4; ++edge) {
    std::vector<Index> on_edge;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const int across = mesh.vertices[i][edge % 2 == 0 ? 0 : 1];
      if (across == (edge < 2 ? 0 : 32767)) on_edge.push_back(static_cast<Index>(i));
    }
    append(bytes, static_cast<std::uint32_t>(on_edge.size()));
    for (const Index index : on_edge) append(bytes, index);
  }
}

/// The tile's bytes. Vertices must be numbered in the order in which the triangles name them first.
inline std::string encoded(const MadeMesh& mesh) {
  std::string bytes;
  for (const double centre : {6378137.0, 0.0, 0.0}) append(bytes, centre);
  append(bytes, mesh.lowest);
  append(bytes, mesh.highest);
  for (int i = 0; i < 7; ++i) append(bytes, 1.0);  // bounding sphere and horizon occlusion point
  append(bytes, static_cast<std::uint32_t>(mesh.vertices.size()));
  for (std::size_t component = 0; component < 3; ++component) {
    int before = 0;
    for (const auto& vertex : mesh.vertices) {
      const int step = vertex[component] - before;
      append(bytes, static_cast<std::uint16_t>(step >= 0 ? 2 * step : -2 * step - 1));
      before = vertex[component];
    }
  }
  if (mesh.vertices.size() > 65536) append_indices<std::uint32_t>(bytes, mesh);
  else append_indices<std::uint16_t>(bytes, mesh);
  return bytes + mesh.extensions;
}

/// The same mesh with its vertices in the order of their first use, as the format wants them; unused ones are dropped.
inline MadeMesh in_order(const MadeMesh& mesh) {
  constexpr std::uint32_t kNone = 0xffffffff;
  std::vector<std::uint32_t> renamed(mesh.vertices.size(), kNone);
  MadeMesh result = mesh;
  result.vertices.clear();
  for (auto& triangle : result.triangles) {
    for (std::uint32_t& index : triangle) {
      if (renamed[index] == kNone) {
        renamed[index] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[index]);
      }
      index = renamed[index];
    }
  }
  return result;
}

}  // namespace tellurion::test
