// Memory prefetching for all compilers.
#pragma once

namespace superfacets {

// Prefetches the cache line of an address. The function is always inlined, because compilers drop
// calls of a function that only prefetches.
#if defined(__GNUC__)
[[gnu::always_inline]] inline void prefetch(const void* address) {
  __builtin_prefetch(address);
}
#else
inline void prefetch(const void*) {}
#endif

}  // namespace superfacets
