#include "gpu/egl_context.h"

#include <epoxy/egl.h>
#include <fmt/format.h>

namespace tellurion::gpu {
namespace {

Error no_context(const char* step) {
  return {ErrorCode::unavailable,
          fmt::format("no OpenGL context without a display: {} failed (EGL error 0x{:04x}). Install Mesa's libegl-mesa0 "
                      "and libgl1-mesa-dri, or a graphics driver with EGL_MESA_platform_surfaceless",
                      step, eglGetError())};
}

#ifdef NDEBUG
constexpr EGLint kContextFlags = 0;
#else
constexpr EGLint kContextFlags = EGL_CONTEXT_OPENGL_DEBUG_BIT_KHR;
#endif

}  // namespace

Result<std::unique_ptr<EglContext>> EglContext::create(Api api) {
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) return no_context("EGL_EXT_platform_base");
  const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  if (display == EGL_NO_DISPLAY) return no_context("eglGetPlatformDisplayEXT");
  if (!eglInitialize(display, nullptr, nullptr)) return no_context("eglInitialize");
  if (!eglBindAPI(api == Api::es ? EGL_OPENGL_ES_API : EGL_OPENGL_API)) return no_context("eglBindAPI");

  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                           api == Api::es ? EGL_OPENGL_ES3_BIT_KHR : EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (!eglChooseConfig(display, wanted, &config, 1, &count) || count == 0) return no_context("eglChooseConfig");

  const EGLint core[] = {EGL_CONTEXT_MAJOR_VERSION_KHR, 4, EGL_CONTEXT_MINOR_VERSION_KHR, 1,
                         EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                         EGL_CONTEXT_FLAGS_KHR, kContextFlags, EGL_NONE};
  const EGLint es[] = {EGL_CONTEXT_MAJOR_VERSION_KHR, 3, EGL_CONTEXT_MINOR_VERSION_KHR, 0,
                       EGL_CONTEXT_FLAGS_KHR, kContextFlags, EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, api == Api::es ? es : core);
  if (context == EGL_NO_CONTEXT) return no_context("eglCreateContext");
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    const Error error = no_context("eglMakeCurrent");
    eglDestroyContext(display, context);
    return error;
  }
  return std::unique_ptr<EglContext>(new EglContext(display, context));
}

EglContext::~EglContext() {
  if (eglGetCurrentContext() == context_) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);  // the display is shared by the whole process and stays
}

}  // namespace tellurion::gpu
