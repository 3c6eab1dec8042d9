// Memory for large arrays, much of it reused: the kernel fills new pages with zeros, which takes
// longer than many stages.
#pragma once

#include <cstddef>

namespace superfacets {

// Arrays of at least this size use take_memory.
inline constexpr std::size_t kLargeMemory = 1 << 16;  // bytes

// Returns uninitialized memory. On Linux it is reused or new, begins on a page, and is in huge
// pages where supported. Elsewhere it comes from operator new, aligned to a cache line. Throws
// std::bad_alloc. May be called on any thread, and after a fork.
void* take_memory(std::size_t n_bytes);

// Takes memory back; n_bytes is the argument that take_memory got. On Linux, a limited amount is
// kept for later calls, and the rest is returned to the system.
void return_memory(void* memory, std::size_t n_bytes) noexcept;

}  // namespace superfacets
