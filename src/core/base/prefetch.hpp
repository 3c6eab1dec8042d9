// Prefetching of memory.
#pragma once

namespace superfacets {

// Prefetches the cache line of an address. Always inlined: compilers consider a function that only
// prefetches to have no effect, and drop calls to it.
#if defined(__GNUC__)
[[gnu::always_inline]] inline void prefetch(const void* address) {
  __builtin_prefetch(address);
}
#else
inline void prefetch(const void*) {}
#endif

}  // namespace superfacets
