// What one tile tells of the others in its archive.
#pragma once

#include <string>

#include "base/result.h"

namespace tellurion::source {

/// Pixels on a side of a tile that is a square picture. Errors: unsupported (no picture that is read, not square), naming `archive`.
Result<int> side_of_tile(const std::string& bytes, const std::string& archive);

/// `html`, in UTF-8, without its tags and control characters, at most 500 bytes of whole characters: an attribution for one line.
std::string plain_text(const std::string& html);

/// Levels deeper than that have more pixels than can be numbered.
int deepest_zoom(int tile_size);

}  // namespace tellurion::source
