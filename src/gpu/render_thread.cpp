#include "gpu/render_thread.h"

#include <algorithm>
#include <cassert>
#include <thread>

#include <epoxy/gl.h>

#include "gpu/egl_context.h"
#include "gpu/graveyard.h"

namespace tellurion::gpu {
namespace {

constexpr std::size_t kMaxDriverErrors = 32;
#ifdef NDEBUG
constexpr bool kListens = false;  // to the driver's messages: costs time
#else
constexpr bool kListens = true;
#endif

bool listens_to_driver() { return kListens && epoxy_has_gl_extension("GL_KHR_debug"); }

/// Text of a glGetString name; empty where the driver has none.
std::string text_of(GLenum what) {
  const auto* text = reinterpret_cast<const char*>(glGetString(what));
  return text ? text : "";
}

Capabilities read_capabilities() {
  Capabilities c;
  c.is_es = !epoxy_is_desktop_gl();
  c.clip_control = c.is_es ? epoxy_has_gl_extension("GL_EXT_clip_control")
                           : epoxy_gl_version() >= 45 || epoxy_has_gl_extension("GL_ARB_clip_control");
  c.anisotropic_filter = epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic") ||
                         epoxy_has_gl_extension("GL_ARB_texture_filter_anisotropic");
  if (c.anisotropic_filter) glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT, &c.max_anisotropy);
  glGetIntegerv(GL_MAX_SAMPLES, &c.max_samples);
  c.renderer = text_of(GL_RENDERER);
  for (const char* name : {"llvmpipe", "softpipe", "SwiftShader"}) c.is_software = c.is_software || c.renderer.find(name) != std::string::npos;
  c.version = text_of(GL_VERSION);
  return c;
}

void GLAPIENTRY on_driver_message(GLenum, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* text,
                                  const void* user) {
  if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR) return;
  auto& errors = *static_cast<std::vector<std::string>*>(const_cast<void*>(user));
  const std::string message(text, static_cast<std::size_t>(length));
  if (errors.size() < kMaxDriverErrors && std::find(errors.begin(), errors.end(), message) == errors.end())
    errors.push_back(message);
}

void listen_to_driver(bool is_es, std::vector<std::string>& errors) {
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  if (is_es) {
    glDebugMessageCallbackKHR(on_driver_message, &errors);
  } else {
    glDebugMessageCallback(on_driver_message, &errors);
  }
}

}  // namespace

struct RenderThread::State {
  Capabilities capabilities;
  std::shared_ptr<Graveyard> graveyard = std::make_shared<Graveyard>();
  std::vector<std::string> driver_errors;
  std::thread::id id = std::this_thread::get_id();
  std::unique_ptr<EglContext> own_context;  // nothing: the context belongs to a window library. Goes first
};

RenderThread::RenderThread(std::unique_ptr<State> state) : state_(std::move(state)) {}

Result<std::unique_ptr<RenderThread>> RenderThread::headless(Api api) {
  auto context = EglContext::create(api);
  if (!context) return context.error();
  auto thread = adopt_current();
  if (thread) (*thread)->state_->own_context = std::move(*context);
  return thread;
}

Result<std::unique_ptr<RenderThread>> RenderThread::adopt_current() {
  if (text_of(GL_VERSION).empty()) return {ErrorCode::unavailable, "no OpenGL context is current on this thread"};
  const int version = epoxy_gl_version();
  if (version < (epoxy_is_desktop_gl() ? 41 : 30)) {
    return {ErrorCode::unsupported, "OpenGL 4.1 or OpenGL ES 3.0 is needed; this driver offers " + text_of(GL_VERSION) +
                                        " (" + text_of(GL_RENDERER) + ")"};
  }
  auto state = std::make_unique<State>();
  state->capabilities = read_capabilities();
  if (listens_to_driver()) listen_to_driver(state->capabilities.is_es, state->driver_errors);
  return std::unique_ptr<RenderThread>(new RenderThread(std::move(state)));
}

RenderThread::~RenderThread() {
  check();
  state_->graveyard->empty();
  state_->graveyard->close();
  if (!state_->own_context && listens_to_driver()) glDisable(GL_DEBUG_OUTPUT);
}

const Capabilities& RenderThread::capabilities() const { return state_->capabilities; }

void RenderThread::disable_capability(const std::string& name) {
  if (name == "clip_control") state_->capabilities.clip_control = false;
  if (name == "anisotropic_filter") {
    state_->capabilities.anisotropic_filter = false;
    state_->capabilities.max_anisotropy = 1.0f;
  }
}

void RenderThread::check() const { assert(state_->id == std::this_thread::get_id()); }

void RenderThread::empty_graveyard() {
  check();
  state_->graveyard->empty();
}

void RenderThread::finish() const {
  check();
  glFinish();
}

const std::shared_ptr<Graveyard>& RenderThread::graveyard() const { return state_->graveyard; }

const std::vector<std::string>& RenderThread::driver_errors() const { return state_->driver_errors; }

}  // namespace tellurion::gpu
