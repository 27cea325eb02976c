// What the header of a JPEG file tells that GDAL does not.
// Thread-safe: pure functions.
#pragma once

#include <string>

namespace tellurion::source {

/// Whether a file is a progressive JPEG: every scan refines the whole picture, so no part of it can be decoded alone, and a
/// decoder keeps all of its coefficients. False for anything else and for what cannot be read.
bool is_progressive_jpeg(const std::string& path);

}  // namespace tellurion::source
