#include "bench/allocation_count.h"

#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TELLURION_WATCHED_ALLOCATIONS 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TELLURION_WATCHED_ALLOCATIONS 1
#endif
#endif

#ifdef TELLURION_WATCHED_ALLOCATIONS

namespace tellurion::bench {
std::optional<std::int64_t> allocations_of_this_thread() { return std::nullopt; }
}  // namespace tellurion::bench

#else

namespace {

thread_local std::int64_t allocation_count = 0;

void* allocate(std::size_t size) {
  ++allocation_count;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();  // what operator new promises
}

void* allocate(std::size_t size, std::align_val_t alignment) {
  ++allocation_count;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}

}  // namespace

// The other forms (arrays, nothrow) call these.
void* operator new(std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace tellurion::bench {
std::optional<std::int64_t> allocations_of_this_thread() { return allocation_count; }
}  // namespace tellurion::bench

#endif
