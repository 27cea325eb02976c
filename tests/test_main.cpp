// The main function of every unit test program.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#ifdef TELLURION_KEEP_LOADED
#include <dlfcn.h>

#include <cstdio>
#endif

int main(int argc, char** argv) {
#ifdef TELLURION_KEEP_LOADED
  // The leak check at exit would blame the OpenGL driver for memory that it cannot see any more once EGL has unloaded
  // it; a handle that is never closed keeps the driver in place.
  if (dlopen(TELLURION_KEEP_LOADED, RTLD_NOW | RTLD_NODELETE) == nullptr) {
    std::fprintf(stderr, "the software OpenGL driver stays unloaded: %s\n", dlerror());
  }
#endif
  return doctest::Context(argc, argv).run();
}
