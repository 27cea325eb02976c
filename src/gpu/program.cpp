#include "gpu/program.h"

#include <cctype>

#include <epoxy/gl.h>
#include <fmt/format.h>

namespace tellurion::gpu {
namespace {

std::string full_text(const RenderThread& thread, const ProgramSource& source, const std::vector<ShaderText>& texts,
                      std::uint32_t features) {
  std::string all = thread.capabilities().is_es
                        ? "#version 300 es\nprecision highp float;\nprecision highp int;\n"
                          "precision highp sampler2D;\nprecision highp sampler2DArray;\n"
                        : "#version 410 core\n";
  for (std::size_t i = 0; i < source.features.size(); ++i)
    if (features >> i & 1u) all += fmt::format("#define {} 1\n", source.features[i]);
  for (std::size_t i = 0; i < texts.size(); ++i) all += fmt::format("#line 1 {}\n{}\n", i, texts[i].text);
  return all;
}

/// Drivers name the text by its number: `1:23(5): error` (Mesa, ANGLE) or `1(23) : error` (NVIDIA). Writes its name there.
std::string with_file_names(const std::string& log, const std::vector<ShaderText>& texts) {
  std::string out;
  std::size_t begin = 0;
  while (begin < log.size()) {
    const std::size_t end = std::min(log.find('\n', begin), log.size());
    std::string line = log.substr(begin, end - begin);
    const std::size_t first = line.find_first_of("0123456789");
    std::size_t last = first;
    while (last < line.size() && std::isdigit(static_cast<unsigned char>(line[last]))) ++last;
    if (first != std::string::npos && last - first <= 2 && last < line.size() && (line[last] == ':' || line[last] == '(')) {
      const auto number = static_cast<std::size_t>(std::stoi(line.substr(first, last - first)));
      if (number < texts.size()) line.replace(first, last - first, texts[number].name);
    }
    if (!line.empty()) out += (out.empty() ? "" : "\n") + line;
    begin = end + 1;
  }
  return out;
}

/// The shader object, or 0 with the message in `error`.
GLuint compile(GLenum stage, const std::string& text, const std::vector<ShaderText>& texts, std::string& error) {
  const GLuint shader = glCreateShader(stage);
  const char* pointer = text.c_str();
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
  error = with_file_names(log, texts);
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
  glDeleteShader(vertex);
  glDeleteShader(fragment);
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
