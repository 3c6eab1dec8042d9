// Memory of the C library's allocator, which numpy uses for its arrays.
#pragma once

#include <cstddef>

namespace superfacets {

// While an object lives, glibc keeps up to n_kept freed bytes for later allocations, and serves
// arrays of up to 32 MB from them. Without it, glibc returns each large array to the kernel, which
// fills new pages with zeros for the next one. No effect with other C libraries. The setting is
// global to the process: if two objects overlap, it ends for both when either is destroyed. glibc
// does not adapt its thresholds any more afterwards. Settings in the environment take precedence:
// nothing is done then.
class HeapScope {
 public:
  explicit HeapScope(std::size_t n_kept);
  HeapScope(const HeapScope&) = delete;
  HeapScope& operator=(const HeapScope&) = delete;
  ~HeapScope();
};

}  // namespace superfacets
