// Unpacking of gzip (RFC 1952).
// Thread-safe: pure functions.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"

namespace tellurion {

/// Whether `bytes` begin as every gzip file that is packed by "deflate" does. A heightmap may happen to begin so.
bool is_gzip(std::string_view bytes);

/// What a gzip file of one or more members holds; checksums are verified. Errors: corrupt (no gzip, cut off, damaged, or
/// followed by anything else), exhausted (more than `most_bytes` come out, or memory lacks); messages say what is wrong, not where.
Result<std::string> gunzip(std::string_view bytes, std::size_t most_bytes);

}  // namespace tellurion
