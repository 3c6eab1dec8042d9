// Memory for large arrays. Much of it is used again: the kernel fills new pages with zeros, which
// takes longer than many a stage.
#pragma once

#include <cstddef>

namespace superfacets {

// Memory of this size or more comes from here.
inline constexpr std::size_t kLargeMemory = 1 << 16;  // bytes

// Uninitialized memory that begins on a page, from what was returned before or from the system, in
// huge pages where it has them. Throws std::bad_alloc. On any thread, and after a fork.
void* take_memory(std::size_t n_bytes);

// Returns memory from take_memory, of the same size. A little of what is returned is kept for what
// comes next, the rest goes back to the system.
void return_memory(void* memory, std::size_t n_bytes) noexcept;

}  // namespace superfacets
