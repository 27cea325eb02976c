# Writes OUTPUT, the definitions of src/render/embedded_shaders.h, from every file below DIRECTORY that LIST_FILE names
# (one a line, relative to DIRECTORY, sorted). Run with cmake -P.
file(STRINGS ${LIST_FILE} names)
set(texts "")
set(entries "")
set(index 0)
foreach(name IN LISTS names)
  file(READ ${DIRECTORY}/${name} hex HEX)
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," characters "${hex}")
  string(REGEX REPLACE "('[^']*','[^']*','[^']*','[^']*','[^']*','[^']*','[^']*','[^']*','[^']*','[^']*',)" "\\1\n    "
    characters "${characters}")
  string(APPEND texts "// ${name}\nconstexpr char kText${index}[] = {\n    ${characters}'\\0'};\n\n")
  string(APPEND entries "    {\"${name}\", {kText${index}, sizeof kText${index} - 1}},\n")
  math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${OUTPUT}.new "// Generated from shaders/ by cmake/embed_shaders.cmake.
#include \"render/embedded_shaders.h\"

#include <array>
#include <utility>

namespace tellurion::render {
namespace {

using NamedText = std::pair<std::string_view, std::string_view>;

${texts}constexpr std::array<NamedText, ${index}> kShaders{{
${entries}}};

constexpr std::array<std::string_view, ${index}> kNames = [] {
  std::array<std::string_view, ${index}> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kShaders[i].first;
  return names;
}();

}  // namespace

std::string_view embedded_shader(std::string_view file_name) {
  for (const auto& [name, text] : kShaders) {
    if (name == file_name) return text;
  }
  return {};
}

std::span<const std::string_view> embedded_shader_names() { return kNames; }

}  // namespace tellurion::render
")
file(COPY_FILE ${OUTPUT}.new ${OUTPUT} ONLY_IF_DIFFERENT)
file(TOUCH_NOCREATE ${OUTPUT})
file(REMOVE ${OUTPUT}.new)
