// Shader programs, built from named texts with features switched by #defines.
// One text serves OpenGL 4.1 core and OpenGL ES 3.0; the first line (#version) is put in front here.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "gpu/object.h"

namespace tellurion::gpu {

/// A piece of GLSL and the file name that errors are to show.
struct ShaderText {
  std::string_view name;
  std::string_view text;
};

/// All that is the same in every variant of a program. The texts must outlive what is made of it.
struct ProgramSource {
  std::vector<ShaderText> vertex;       ///< compiled one after the other as one text
  std::vector<ShaderText> fragment;
  std::vector<std::string_view> features;  ///< feature i, bit i of a variant's mask, is `#define <name> 1`
  std::vector<const char*> uniforms;    ///< those that the caller sets, by index
  std::vector<const char*> samplers;    ///< sampler i reads texture unit i
  std::vector<const char*> blocks;      ///< uniform block i reads binding point i
};

/// One variant, linked.
struct LinkedProgram {
  Program program;
  std::vector<int> locations;  ///< of ProgramSource::uniforms; -1 where this variant does not use it
};

/// Compiles and links the variant of `source` with `features`.
/// Errors: internal, with the driver's message, file names and line numbers of the texts put in.
Result<LinkedProgram> link_program(RenderThread& thread, const ProgramSource& source, std::uint32_t features);

/// The variants of one program, built when first asked for.
class ProgramFamily {
 public:
  explicit ProgramFamily(ProgramSource source) : source_(std::move(source)) {}

  /// The variant, valid as long as the family.
  Result<const LinkedProgram*> variant(RenderThread& thread, std::uint32_t features);

 private:
  ProgramSource source_;
  std::vector<std::pair<std::uint32_t, std::unique_ptr<LinkedProgram>>> variants_;  // few: searched in order
};

}  // namespace tellurion::gpu
