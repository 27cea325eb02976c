// The proof that a function runs on the thread whose OpenGL context is current.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"

namespace tellurion::gpu {

/// What the context can do beyond the baseline of OpenGL ES 3.0 / OpenGL 4.1 core.
struct Capabilities {
  bool is_es = false;
  bool clip_control = false;       ///< reversed depth
  bool anisotropic_filter = false;
  float max_anisotropy = 1.0f;
  int max_samples = 1;
  bool is_software = false;        ///< a rasteriser on the CPU: what it keeps of a frame's triangles is the process' own memory
  std::string renderer;            ///< GL_RENDERER
  std::string version;             ///< GL_VERSION
};

enum class Api { core, es };

class Graveyard;

/// Taken first by everything that touches OpenGL; only `globe` and tests make one. A debug assertion checks the thread.
class RenderThread {
 public:
  /// A context of our own without a window or display (EGL, surfaceless), current on this thread.
  /// Errors: unavailable, saying which package or driver is missing.
  static Result<std::unique_ptr<RenderThread>> headless(Api api);
  /// The context that is current on this thread, made by a window library. It stays theirs.
  static Result<std::unique_ptr<RenderThread>> adopt_current();
  ~RenderThread();

  const Capabilities& capabilities() const;
  /// For tests: behave as on a context without the capability ("clip_control", "anisotropic_filter").
  void disable_capability(const std::string& name);

  /// Asserts (debug builds) that the caller is on the right thread.
  void check() const;
  /// Deletes the GL objects whose owners were dropped since the last call, on whatever thread.
  void empty_graveyard();
  /// Waits until everything asked for so far is drawn. For timing: drivers draw behind the caller's back.
  void finish() const;
  /// Where handles of this context leave the names of what they owned.
  const std::shared_ptr<Graveyard>& graveyard() const;

  /// What the driver has complained about so far, each kind once, at most 32 (debug builds only; empty elsewhere).
  const std::vector<std::string>& driver_errors() const;

 private:
  struct State;
  explicit RenderThread(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::gpu
