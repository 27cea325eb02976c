// Holds every OpenGL name in src/gpu and src/render against Khronos' own headers: GLES3/gl3.h lists OpenGL ES 3.0,
// GL/glcorearb.h lists desktop OpenGL by version. Mesa's contexts are newer than asked for, so only this stops mistakes.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <doctest/doctest.h>

namespace {

using Names = std::set<std::string>;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

Names names_in(const std::string& text) {
  static const std::regex name(R"(\b(gl[A-Z]\w*|GL_[A-Z0-9]\w*)\b)");
  Names names;
  for (std::sregex_iterator i(text.begin(), text.end(), name), end; i != end; ++i) names.insert(i->str());
  return names;
}

/// Names of both interfaces, up to OpenGL 4.1 and OpenGL ES 3.0.
Names baseline() {
  const std::string desktop = text_of("/usr/include/GL/glcorearb.h");
  const std::size_t end = desktop.find("#ifndef GL_VERSION_4_2");
  REQUIRE(end != std::string::npos);
  const Names core = names_in(desktop.substr(0, end));
  const Names es = names_in(text_of("/usr/include/GLES3/gl3.h"));
  Names both;
  std::set_intersection(core.begin(), core.end(), es.begin(), es.end(), std::inserter(both, both.end()));
  REQUIRE(both.count("glDrawElements") == 1);
  REQUIRE(both.count("glTexStorage3D") == 0);     // OpenGL 4.2
  REQUIRE(both.count("glDispatchCompute") == 0);  // OpenGL 4.3, OpenGL ES 3.1
  return both;
}

/// Beyond the baseline, each used only where Capabilities or an extension query says so.
const Names kCapabilities = {
    "glClipControl", "glClipControlEXT", "GL_LOWER_LEFT", "GL_LOWER_LEFT_EXT", "GL_ZERO_TO_ONE", "GL_ZERO_TO_ONE_EXT",
    "GL_NEGATIVE_ONE_TO_ONE", "GL_NEGATIVE_ONE_TO_ONE_EXT", "GL_EXT_clip_control", "GL_ARB_clip_control",
    "GL_TEXTURE_MAX_ANISOTROPY_EXT", "GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT", "GL_EXT_texture_filter_anisotropic",
    "GL_ARB_texture_filter_anisotropic", "glDebugMessageCallback", "glDebugMessageCallbackKHR", "GL_DEBUG_OUTPUT",
    "GL_DEBUG_OUTPUT_SYNCHRONOUS", "GL_DEBUG_TYPE_ERROR", "GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR", "GL_KHR_debug"};

/// Names that `text` uses beyond the baseline, comments left out.
Names beyond_baseline(std::string text, const Names& allowed) {
  text = std::regex_replace(text, std::regex("//[^\n]*"), "");
  Names beyond;
  for (const std::string& name : names_in(text)) {
    if (!allowed.count(name) && !kCapabilities.count(name)) beyond.insert(name);
  }
  return beyond;
}

}  // namespace

TEST_CASE("sources: name nothing newer than OpenGL 4.1 and OpenGL ES 3.0 except named capabilities") {
  if (!std::filesystem::exists("/usr/include/GL/glcorearb.h") || !std::filesystem::exists("/usr/include/GLES3/gl3.h")) {
    MESSAGE("skipped: Khronos' headers are not installed");
    return;
  }
  const Names allowed = baseline();
  int files = 0;
  for (const char* room : {"src/gpu", "src/render"}) {
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TELLURION_SOURCE_DIR) / room)) {
      ++files;
      for (const std::string& name : beyond_baseline(text_of(entry.path()), allowed))
        FAIL_CHECK(entry.path().filename().string() << " uses " << name);
    }
  }
  CHECK(files > 20);
  CHECK(beyond_baseline("glTexStorage2D(GL_TEXTURE_2D);", allowed) == Names{"glTexStorage2D"});  // the check can fail
}

TEST_CASE("shaders: leave the version to the program builder") {
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TELLURION_SOURCE_DIR) / "shaders")) {
    INFO(entry.path().filename().string());
    CHECK(text_of(entry.path()).find("#version") == std::string::npos);
    CHECK(text_of(entry.path()).find("#extension") == std::string::npos);
  }
}
