// Memory that the C library hands out, as to numpy for its arrays.
#pragma once

#include <cstddef>

namespace superfacets {

// While one lives, glibc keeps up to so many bytes of what is freed for what is allocated next, and
// takes arrays of up to 32 MB from there. Otherwise it gives back each large array when it is
// freed, and the kernel fills new pages with zeros for the next one. Nothing elsewhere. It is a
// setting of the whole process: where two overlap, the end of the first ends it for both. Later,
// glibc's own rules do not change it any more. Where the environment says what glibc is to do, this
// does nothing.
class HeapScope {
 public:
  explicit HeapScope(std::size_t n_kept);
  HeapScope(const HeapScope&) = delete;
  HeapScope& operator=(const HeapScope&) = delete;
  ~HeapScope();
};

}  // namespace superfacets
