#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "gpu/program.h"

using namespace tellurion;
using namespace tellurion::gpu;

namespace {

constexpr ShaderText kShared{"shared.glsl", "layout(std140) uniform Block { vec4 tint; };\n"};
constexpr ShaderText kVertex{"one.vert", R"(
void main() { gl_Position = vec4(0.0); })"};
constexpr ShaderText kFragment{"one.frag", R"(
layout(location = 0) out vec4 o_colour;
uniform vec4 u_factor;
uniform vec4 u_strength;
void main() {
  o_colour = u_factor;
#ifdef TINTED
  o_colour *= tint * u_strength;
#endif
})"};

ProgramSource source_with(std::vector<ShaderText> fragment) {
  return {{kVertex}, std::move(fragment), {"OTHER", "TINTED"}, {"u_factor", "u_strength"}, {}, {"Block"}};
}

}  // namespace

TEST_CASE("link_program: one text serves both interfaces; features are bits") {
  for (const Api api : {Api::core, Api::es}) {
    auto thread = RenderThread::headless(api);
    REQUIRE(thread.has_value());
    const auto source = source_with({kShared, kFragment});
    for (const std::uint32_t features : {0u, 2u}) {
      const auto linked = link_program(**thread, source, features);
      REQUIRE(linked.has_value());
      CHECK(linked->locations[0] >= 0);
      CHECK((linked->locations[1] >= 0) == (features == 2u));  // what a variant does not use is not there
    }
    CHECK(glGetError() == GL_NO_ERROR);
  }
}

TEST_CASE("link_program: an error names the file and the line") {
  constexpr ShaderText kWrong{"wrong.frag", "\n\nvoid main() {\n  no_such_function();\n}\n"};
  for (const Api api : {Api::core, Api::es}) {
    auto thread = RenderThread::headless(api);
    REQUIRE(thread.has_value());
    const auto linked = link_program(**thread, source_with({kShared, kWrong}), 0);
    REQUIRE_FALSE(linked.has_value());
    CHECK(linked.error().code == ErrorCode::internal);
    CHECK_MESSAGE(linked.error().message.find("wrong.frag:4") != std::string::npos, linked.error().message);
    CHECK(linked.error().message.find("no_such_function") != std::string::npos);
  }
}

TEST_CASE("ProgramFamily: builds a variant once and remembers it") {
  auto thread = RenderThread::headless(Api::core);
  REQUIRE(thread.has_value());
  ProgramFamily family(source_with({kShared, kFragment}));
  const auto plain = family.variant(**thread, 0);
  const auto tinted = family.variant(**thread, 2);
  REQUIRE((plain && tinted));
  CHECK(*plain != *tinted);
  CHECK(*family.variant(**thread, 0) == *plain);
}
