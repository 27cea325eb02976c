// A tile's triangles on the GPU.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

#include "gpu/object.h"
#include "render/budget.h"
#include "surface/tile_content.h"

namespace tellurion::render {

/// Owns the buffers and remembers what a frame needs to place them.
class ResidentMesh {
 public:
  ResidentMesh(const gpu::RenderThread& thread, const surface::TileMesh& mesh, Budget& budget);
  ~ResidentMesh() { budget_->used -= bytes_; }
  ResidentMesh(const ResidentMesh&) = delete;
  ResidentMesh& operator=(const ResidentMesh&) = delete;

  /// `step`: one of the mesh's triangulations.
  void draw_triangles(std::size_t step) const;
  /// The triangles' edges; their indices are made when first asked for.
  void draw_lines(const gpu::RenderThread& thread, std::size_t step);

  int index_count(std::size_t step) const { return static_cast<int>(steps_[step].index_count); }
  /// The origin at `exaggeration`, body-centred.
  glm::dvec3 origin(double exaggeration) const { return origin_base_ + exaggeration * reference_height_ * origin_up_; }
  const glm::dvec3& origin_up() const { return origin_up_; }
  double reference_height() const { return reference_height_; }

  /// A box round the surface at `exaggeration`: its lowest corner and its edges.
  struct Box {
    glm::dvec3 corner;
    glm::dvec3 edges[3];
  };
  Box box(double exaggeration) const;

 private:
  struct Lines {
    gpu::Buffer indices;
    int index_count = 0;
  };
  Lines make_lines(const gpu::RenderThread& thread, const surface::MeshStep& step);
  void measure_box(const surface::TileMesh& mesh);

  Budget* budget_;
  std::size_t bytes_ = 0;
  gpu::VertexArray array_;
  gpu::Buffer vertices_;
  gpu::Buffer indices_;
  std::vector<surface::MeshStep> steps_;
  std::array<Lines, surface::kMostMeshSteps> lines_;
  glm::dvec3 origin_base_;
  glm::dvec3 origin_up_;
  double reference_height_;
  glm::dvec3 axes_[2];             // across origin_up
  glm::dvec3 lower_{0}, upper_{0};  // along axes_ and origin_up, at exaggeration 1 across and 0 along
  double lowest_ = 0, highest_ = 0;  // heights above the ellipsoid
};

}  // namespace tellurion::render
