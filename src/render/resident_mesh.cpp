#include "render/resident_mesh.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

namespace tellurion::render {
namespace {

using surface::TileVertex;

void describe(GLuint location, GLint components, std::size_t offset) {
  glEnableVertexAttribArray(location);
  glVertexAttribPointer(location, components, GL_FLOAT, GL_FALSE, sizeof(TileVertex), reinterpret_cast<const void*>(offset));
}

/// Every edge of the triangles once.
std::vector<std::uint16_t> edges_of(const std::uint16_t* indices, std::size_t count) {
  std::vector<std::uint32_t> edges;
  edges.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t a = indices[i];
    const std::uint32_t b = indices[i % 3 == 2 ? i - 2 : i + 1];
    edges.push_back(std::min(a, b) << 16 | std::max(a, b));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::vector<std::uint16_t> lines;
  lines.reserve(edges.size() * 2);
  for (const std::uint32_t edge : edges) {
    lines.push_back(static_cast<std::uint16_t>(edge >> 16));
    lines.push_back(static_cast<std::uint16_t>(edge));
  }
  return lines;
}

}  // namespace

ResidentMesh::ResidentMesh(const gpu::RenderThread& thread, const surface::TileMesh& mesh, Budget& budget)
    : budget_(&budget),
      bytes_(mesh.bytes()),
      array_(thread),
      vertices_(thread),
      indices_(thread),
      steps_(mesh.steps),
      origin_base_(mesh.origin_base.xyz),
      origin_up_(mesh.origin_up.xyz),
      reference_height_(mesh.reference_height) {
  budget_->used += bytes_;
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(TileVertex)), mesh.vertices.data(),
               GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(std::uint16_t)),
               mesh.indices.data(), GL_STATIC_DRAW);
  describe(0, 3, offsetof(TileVertex, base));
  describe(1, 3, offsetof(TileVertex, up_offset));
  describe(2, 2, offsetof(TileVertex, height));  // and parent_height
  describe(3, 2, offsetof(TileVertex, st));
  describe(4, 1, offsetof(TileVertex, skirt));
  glBindVertexArray(0);
  measure_box(mesh);
}

void ResidentMesh::measure_box(const surface::TileMesh& mesh) {
  const glm::dvec3 helper = std::abs(origin_up_.z) < 0.7 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  axes_[0] = glm::normalize(glm::cross(helper, origin_up_));
  axes_[1] = glm::cross(origin_up_, axes_[0]);
  lower_ = glm::dvec3(std::numeric_limits<double>::max());
  upper_ = -lower_;
  lowest_ = std::numeric_limits<double>::max();
  highest_ = -lowest_;
  for (const TileVertex& v : mesh.vertices) {
    if (v.skirt != 0) continue;
    const double height = reference_height_ + static_cast<double>(v.height);
    const glm::dvec3 bare(v.base);
    const glm::dvec3 raised = bare + height * glm::dvec3(v.up_offset);
    const glm::dvec3 along(glm::dot(raised, axes_[0]), glm::dot(raised, axes_[1]), glm::dot(bare, origin_up_));
    lower_ = glm::min(lower_, along);
    upper_ = glm::max(upper_, along);
    lowest_ = std::min(lowest_, height);
    highest_ = std::max(highest_, height);
  }
}

ResidentMesh::Box ResidentMesh::box(double exaggeration) const {
  const double bottom = lower_.z + exaggeration * lowest_;
  const double top = upper_.z + exaggeration * highest_;
  return {origin_base_ + lower_.x * axes_[0] + lower_.y * axes_[1] + bottom * origin_up_,
          {(upper_.x - lower_.x) * axes_[0], (upper_.y - lower_.y) * axes_[1], (top - bottom) * origin_up_}};
}

void ResidentMesh::draw_triangles(std::size_t step) const {
  glBindVertexArray(array_.name());
  glDrawElements(GL_TRIANGLES, index_count(step), GL_UNSIGNED_SHORT,
                 reinterpret_cast<const void*>(steps_[step].first_index * sizeof(std::uint16_t)));
}

void ResidentMesh::draw_lines(const gpu::RenderThread& thread, std::size_t step) {
  glBindVertexArray(array_.name());
  Lines& lines = lines_[step];
  if (!lines.indices) lines = make_lines(thread, steps_[step]);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, lines.indices.name());
  glDrawElements(GL_LINES, lines.index_count, GL_UNSIGNED_SHORT, nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
}

ResidentMesh::Lines ResidentMesh::make_lines(const gpu::RenderThread& thread, const surface::MeshStep& step) {
  Lines lines{gpu::Buffer(thread)};
  const auto first = static_cast<GLintptr>(step.first_index * sizeof(std::uint16_t));
  const void* indices = glMapBufferRange(GL_ELEMENT_ARRAY_BUFFER, first,
                                         static_cast<GLsizeiptr>(step.index_count * sizeof(std::uint16_t)), GL_MAP_READ_BIT);
  if (!indices) return lines;
  const auto edges = edges_of(static_cast<const std::uint16_t*>(indices), step.index_count);
  glUnmapBuffer(GL_ELEMENT_ARRAY_BUFFER);
  const std::size_t line_bytes = edges.size() * sizeof(std::uint16_t);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, lines.indices.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(line_bytes), edges.data(), GL_STATIC_DRAW);
  lines.index_count = static_cast<int>(edges.size());
  bytes_ += line_bytes;
  budget_->used += line_bytes;
  return lines;
}

}  // namespace tellurion::render
