#include "base/heap.hpp"

#if defined(__linux__)
#include <features.h>
#endif

#if defined(__GLIBC__)
#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#endif

namespace superfacets {

#if defined(__GLIBC__)
namespace {

// Largest mmap threshold that glibc accepts, in bytes. glibc adapts its thresholds at run time:
// after a process has freed arrays of this size, its mmap threshold equals this value, and its trim
// threshold is twice this value.
constexpr int kLargestFromHeap = 32 << 20;
constexpr int kUsuallyKept = 2 * kLargestFromHeap;

bool has_user_settings() {
  return std::getenv("MALLOC_TRIM_THRESHOLD_") != nullptr ||
         std::getenv("MALLOC_MMAP_THRESHOLD_") != nullptr ||
         std::getenv("GLIBC_TUNABLES") != nullptr;
}

}  // namespace

HeapScope::HeapScope(std::size_t n_kept) {
  if (has_user_settings()) return;
  constexpr std::size_t most = std::numeric_limits<int>::max();
  ::mallopt(M_MMAP_THRESHOLD, kLargestFromHeap);
  ::mallopt(M_TRIM_THRESHOLD, static_cast<int>(std::min(n_kept, most)));
}

HeapScope::~HeapScope() {
  if (has_user_settings()) return;
  ::mallopt(M_TRIM_THRESHOLD, kUsuallyKept);
  ::malloc_trim(kUsuallyKept);
}
#else
HeapScope::HeapScope(std::size_t /*n_kept*/) {}
HeapScope::~HeapScope() = default;
#endif

}  // namespace superfacets
