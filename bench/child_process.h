// Other programs, run to their end.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace tellurion::bench {

struct FinishedProgram {
  std::string output;  ///< what it wrote to standard output
  double seconds = 0;  ///< from start to end
};

/// Runs `words` (the program is looked for as a shell does) and waits. Its standard error goes nowhere.
/// Errors: not_found (no such program), internal (any exit status but 0); both name the command.
Result<FinishedProgram> run_program(const std::vector<std::string>& words);

/// The file of the program that is running.
std::filesystem::path this_program();

}  // namespace tellurion::bench
