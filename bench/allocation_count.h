// Counts what this thread allocates with operator new.
#pragma once

#include <cstdint>
#include <optional>

namespace tellurion::bench {

/// Allocations of the calling thread since it started; nothing in builds whose sanitizer watches the allocations itself.
/// Linking this replaces the program's operator new by malloc and an increment (0.3 ns).
std::optional<std::int64_t> allocations_of_this_thread();

}  // namespace tellurion::bench
