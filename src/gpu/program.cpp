#include "gpu/program.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <sstream>

#include <epoxy/gl.h>
#include <fmt/format.h>

namespace tellurion::gpu {
namespace {

/// One text for the driver, and where in it each piece begins.
struct FullText {
  std::string text;
  std::vector<std::ptrdiff_t> first_lines;  // of the pieces, counted from 1
};

FullText full_text(const RenderThread& thread, const ProgramSource& source, const std::vector<ShaderText>& pieces,
                   std::uint32_t features) {
  FullText all;
  all.text = thread.capabilities().is_es
                 ? "#version 300 es\nprecision highp float;\nprecision highp int;\n"
                   "precision highp sampler2D;\nprecision highp sampler2DArray;\n"
                 : "#version 410 core\n";
  for (std::size_t i = 0; i < source.features.size(); ++i)
    if (features >> i & 1u) all.text += fmt::format("#define {} 1\n", source.features[i]);
  for (const ShaderText& piece : pieces) {
    all.first_lines.push_back(1 + std::count(all.text.begin(), all.text.end(), '\n'));
    all.text += piece.text;
    all.text += '\n';
  }
  return all;
}

/// A number at `position` of `line`, which moves behind it; negative if there is none.
std::ptrdiff_t read_number(const std::string& line, std::size_t& position) {
  std::ptrdiff_t number = 0;
  const auto [end, status] = std::from_chars(line.data() + position, line.data() + line.size(), number);
  if (status != std::errc()) return -1;
  position = static_cast<std::size_t>(end - line.data());
  return number;
}

/// Drivers name a place by the text's number, 0, and the line: `0:23(5): error` (Mesa, ANGLE), `0(23) : error` (NVIDIA).
/// Writes the piece's name and its own line there instead.
std::string with_places(const std::string& log, const FullText& all, const std::vector<ShaderText>& pieces) {
  std::string out;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find_first_of("0123456789");
    std::size_t end = begin;
    if (begin != std::string::npos && read_number(line, end) == 0 && end < line.size() &&
        (line[end] == ':' || line[end] == '(')) {
      const std::ptrdiff_t number = read_number(line, ++end);
      const auto next = std::upper_bound(all.first_lines.begin(), all.first_lines.end(), number);
      if (next != all.first_lines.begin()) {
        const auto piece = static_cast<std::size_t>(next - all.first_lines.begin() - 1);
        line.replace(begin, end - begin, fmt::format("{}:{}", pieces[piece].name, number - all.first_lines[piece] + 1));
      }
    }
    out += (out.empty() ? "" : "\n") + line;
  }
  return out;
}

/// The shader object, or 0 with the message in `error`.
GLuint compile(GLenum stage, const FullText& all, const std::vector<ShaderText>& pieces, std::string& error) {
  const GLuint shader = glCreateShader(stage);
  const char* pointer = all.text.c_str();
  glShaderSource(shader, 1, &pointer, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok) return shader;
  GLint length = 0;
  glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
  glGetShaderInfoLog(shader, length, &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  glDeleteShader(shader);
  error = with_places(log, all, pieces);
  return 0;
}

}  // namespace

Result<LinkedProgram> link_program(RenderThread& thread, const ProgramSource& source, std::uint32_t features) {
  std::string error;
  const GLuint vertex = compile(GL_VERTEX_SHADER, full_text(thread, source, source.vertex, features), source.vertex, error);
  if (vertex == 0) return {ErrorCode::internal, error};
  const GLuint fragment =
      compile(GL_FRAGMENT_SHADER, full_text(thread, source, source.fragment, features), source.fragment, error);
  if (fragment == 0) {
    glDeleteShader(vertex);
    return {ErrorCode::internal, error};
  }

  LinkedProgram linked{Program(thread), {}};
  const GLuint name = linked.program.name();
  glAttachShader(name, vertex);
  glAttachShader(name, fragment);
  glLinkProgram(name);
  for (const GLuint shader : {vertex, fragment}) {
    glDetachShader(name, shader);  // or it would live as long as the program, text and all
    glDeleteShader(shader);
  }
  GLint ok = 0;
  glGetProgramiv(name, GL_LINK_STATUS, &ok);
  if (!ok) {
    char log[2000];
    GLsizei length = 0;
    glGetProgramInfoLog(name, sizeof log, &length, log);
    return {ErrorCode::internal, fmt::format("linking {} and {}: {}", source.vertex.back().name,
                                             source.fragment.back().name, std::string(log, static_cast<std::size_t>(length)))};
  }

  for (const char* uniform : source.uniforms) linked.locations.push_back(glGetUniformLocation(name, uniform));
  glUseProgram(name);
  for (std::size_t i = 0; i < source.samplers.size(); ++i)
    glUniform1i(glGetUniformLocation(name, source.samplers[i]), static_cast<GLint>(i));
  for (std::size_t i = 0; i < source.blocks.size(); ++i) {
    const GLuint block = glGetUniformBlockIndex(name, source.blocks[i]);
    if (block != GL_INVALID_INDEX) glUniformBlockBinding(name, block, static_cast<GLuint>(i));
  }
  return linked;
}

Result<const LinkedProgram*> ProgramFamily::variant(RenderThread& thread, std::uint32_t features) {
  for (const auto& [mask, program] : variants_)
    if (mask == features) return program.get();
  auto linked = link_program(thread, source_, features);
  if (!linked) return linked.error();
  variants_.emplace_back(features, std::make_unique<LinkedProgram>(std::move(*linked)));
  return variants_.back().second.get();
}

}  // namespace tellurion::gpu
