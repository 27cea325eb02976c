// Owners of OpenGL objects: move-only, may be dropped on any thread.
#pragma once

#include <memory>
#include <utility>

#include "gpu/graveyard.h"
#include "gpu/render_thread.h"

namespace tellurion::gpu {

/// A new name of `kind` in the current context.
unsigned create_name(const RenderThread& thread, ObjectKind kind);

/// Owns one OpenGL object. Empty by default; making one needs the render thread, dropping one does not.
template <ObjectKind kind>
class Object {
 public:
  Object() = default;
  explicit Object(const RenderThread& thread) : name_(create_name(thread, kind)), graveyard_(thread.graveyard()) {}
  Object(Object&& other) noexcept
      : name_(std::exchange(other.name_, 0u)), graveyard_(std::move(other.graveyard_)) {}
  Object& operator=(Object&& other) noexcept {
    Object old(std::move(*this));
    name_ = std::exchange(other.name_, 0u);
    graveyard_ = std::move(other.graveyard_);
    return *this;
  }
  ~Object() {
    if (name_ != 0) graveyard_->bury(kind, name_);
  }

  /// The OpenGL name; 0 if empty.
  unsigned name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  unsigned name_ = 0;
  std::shared_ptr<Graveyard> graveyard_;
};

using Buffer = Object<ObjectKind::buffer>;
using Texture = Object<ObjectKind::texture>;
using Framebuffer = Object<ObjectKind::framebuffer>;
using Renderbuffer = Object<ObjectKind::renderbuffer>;
using Program = Object<ObjectKind::program>;
using Sampler = Object<ObjectKind::sampler>;
using VertexArray = Object<ObjectKind::vertex_array>;

}  // namespace tellurion::gpu
