// Files of the work folder that are there as a whole or not at all.
// Functions of values; they write files.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace tellurion::prepare {

/// Writes beside `file` and renames. Errors: unavailable, naming the file.
Result<void> write_whole(const std::filesystem::path& file, std::string_view content);

}  // namespace tellurion::prepare
