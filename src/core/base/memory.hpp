// Memory for large arrays, much of it reused: the kernel fills new pages with zeros, which takes
// longer than many stages.
#pragma once

#include <cstddef>

namespace superfacets {

// Memory of this size or more comes from here.
inline constexpr std::size_t kLargeMemory = 1 << 16;  // bytes

// Uninitialized memory that begins on a page, recycled or from the system, in huge pages where
// supported. Throws std::bad_alloc. May be called on any thread, and after a fork.
void* take_memory(std::size_t n_bytes);

// Takes back memory from take_memory; n_bytes is the number it was taken with. A limited amount is
// kept for later calls, the rest is returned to the system.
void return_memory(void* memory, std::size_t n_bytes) noexcept;

}  // namespace superfacets
