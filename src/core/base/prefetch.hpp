// Asking for memory before it is needed.
#pragma once

namespace superfacets {

// Begins to bring what stands at an address into the nearest cache. Always inlined: a function that
// does nothing else counts as one without effect, and compilers drop calls to it.
#if defined(__GNUC__)
[[gnu::always_inline]] inline void prefetch(const void* address) {
  __builtin_prefetch(address);
}
#else
inline void prefetch(const void*) {}
#endif

}  // namespace superfacets
