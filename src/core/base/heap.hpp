// Settings of the C library's allocator, which numpy uses for its arrays.
#pragma once

#include <cstddef>

namespace superfacets {

// While a HeapScope exists, glibc keeps up to n_kept freed bytes for later allocations, and serves
// arrays of up to 32 MB from these bytes. Without a scope, glibc returns the memory of each large
// array to the operating system. The next array then gets new pages, which the system must first
// fill with zeros. The scope has no effect with other C libraries. The setting is global to the
// process: if two scopes overlap, the setting ends for both when either scope is destroyed.
// Afterwards glibc no longer adapts its thresholds. If the environment sets thresholds or tunables
// of glibc, the scope does nothing.
class HeapScope {
 public:
  explicit HeapScope(std::size_t n_kept);
  HeapScope(const HeapScope&) = delete;
  HeapScope& operator=(const HeapScope&) = delete;
  ~HeapScope();
};

}  // namespace superfacets
