#include "base/buffer.hpp"

#if defined(__linux__)
#include <sys/mman.h>

#include <algorithm>
#include <limits>
#include <map>
#include <mutex>
#endif

namespace superfacets {

#if defined(__linux__)
namespace {

constexpr std::size_t kPage = 1 << 16;      // in bytes; a multiple of all common page sizes
constexpr std::size_t kHugePage = 1 << 21;  // in bytes; size of a huge page on most systems

// The pool keeps at most kAlwaysKept bytes of unused memory, or as much as is in use, whichever is
// larger. kAlwaysKept suffices for a mesh of a few hundred thousand faces. Keeping more would raise
// peak memory.
constexpr std::size_t kAlwaysKept = 64 << 20;

constexpr std::size_t rounded_up(std::size_t n, std::size_t unit) {
  return (n + unit - 1) / unit * unit;
}

void* map_memory(std::size_t n_bytes) {
  void* data = ::mmap(nullptr, n_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  ::madvise(data, n_bytes, MADV_HUGEPAGE);  // the operating system may ignore this hint
  return data;
}

// Pool of unused memory: ranges of whole pages, with adjacent ranges merged. Any part of a range
// can be handed out or returned to the system.
class Pool {
 public:
  void* take(std::size_t n_bytes) {
    const auto best = best_fit(n_bytes);
    void* const memory = best == ranges_.end() ? map_new(n_bytes) : cut(best, n_bytes);
    n_used_ += n_bytes;
    return memory;
  }

  void give(void* memory, std::size_t n_bytes) {
    n_used_ -= std::min(n_used_, n_bytes);  // clamped at 0, because n_used_ is not exact
    add(static_cast<std::byte*>(memory), n_bytes);
    shrink(std::max(kAlwaysKept, n_used_));
  }

 private:
  using Ranges = std::map<std::byte*, std::size_t>;  // start and size in bytes of each range

  // Finds the smallest range that is large enough.
  Ranges::iterator best_fit(std::size_t n_bytes) {
    auto best = ranges_.end();
    for (auto range = ranges_.begin(); range != ranges_.end(); ++range) {
      if (range->second < n_bytes) continue;
      if (best == ranges_.end() || range->second < best->second) best = range;
    }
    return best;
  }

  // Takes memory from the end of a range. Each mapping is used from its end to its start, so pages
  // that were used before are handed out again before untouched pages.
  void* cut(Ranges::iterator range, std::size_t n_bytes) {
    range->second -= n_bytes;
    n_free_ -= n_bytes;
    void* const memory = range->first + range->second;
    if (range->second == 0) ranges_.erase(range);
    return memory;
  }

  // Maps whole huge pages, returns the end of the mapping, and adds the remainder to the pool.
  void* map_new(std::size_t n_bytes) {
    const std::size_t n_mapped = rounded_up(n_bytes, kHugePage);
    const std::size_t n_left = n_mapped - n_bytes;
    shrink(n_free_ - std::min(n_free_, n_mapped));
    void* const memory = map_memory(n_mapped);
    auto* const begin = static_cast<std::byte*>(memory);
    try {
      if (n_left > 0) add(begin, n_left);
    } catch (...) {
      ::munmap(memory, n_mapped);
      throw;
    }
    return begin + n_left;
  }

  void add(std::byte* begin, std::size_t size) {
    const auto next = ranges_.lower_bound(begin);
    const auto before = next == ranges_.begin() ? ranges_.end() : std::prev(next);
    const bool joins_next = next != ranges_.end() && begin + size == next->first;
    const bool joins_before = before != ranges_.end() && before->first + before->second == begin;
    const std::size_t total = size + (joins_next ? next->second : 0);
    if (joins_before) {
      before->second += total;
    } else {
      ranges_.emplace_hint(next, begin, total);
    }
    if (joins_next) ranges_.erase(next);
    n_free_ += size;
  }

  // Returns ranges to the system, the largest first, until at most n_kept bytes remain in the pool.
  void shrink(std::size_t n_kept) {
    while (n_free_ > n_kept) {
      const auto largest = std::ranges::max_element(
          ranges_, [](const auto& a, const auto& b) { return a.second < b.second; });
      const std::size_t size = std::min(largest->second, rounded_up(n_free_ - n_kept, kPage));
      largest->second -= size;
      n_free_ -= size;
      ::munmap(largest->first + largest->second, size);
      if (largest->second == 0) ranges_.erase(largest);
    }
  }

  Ranges ranges_;
  std::size_t n_free_ = 0;
  std::size_t n_used_ = 0;  // bytes in use, except memory that was mapped while the pool was locked
};

std::mutex pool_mutex;

// The pool is never destroyed, because arrays may still return memory to it while the process
// exits.
Pool& pool() {
  static Pool* const only = new Pool;
  return *only;
}

}  // namespace

// If the pool is locked, memory comes from the system instead of waiting for the lock. Waiting
// could deadlock: in a process that was forked while another thread held the lock, the lock is
// never released.
void* take_memory(std::size_t n_bytes) {
  const std::size_t n_taken = rounded_up(n_bytes, kPage);
  const std::unique_lock lock(pool_mutex, std::try_to_lock);
  return lock.owns_lock() ? pool().take(n_taken) : map_memory(n_taken);
}

void return_memory(void* memory, std::size_t n_bytes) noexcept {
  const std::size_t n_returned = rounded_up(n_bytes, kPage);
  const std::unique_lock lock(pool_mutex, std::try_to_lock);
  if (!lock.owns_lock()) {
    ::munmap(memory, n_returned);
    return;
  }
  try {
    pool().give(memory, n_returned);
  } catch (const std::bad_alloc&) {  // not enough memory to record the range in the pool
    ::munmap(memory, n_returned);
  }
}

void return_end_of_memory(void* memory, std::size_t n_bytes, std::size_t n_kept) noexcept {
  const std::size_t n_left = rounded_up(n_kept, kPage);
  const std::size_t n_taken = rounded_up(n_bytes, kPage);
  if (n_left < n_taken) return_memory(static_cast<std::byte*>(memory) + n_left, n_taken - n_left);
}

#else

namespace {
constexpr std::align_val_t kAlignment{64};  // size of a cache line in bytes
}

void* take_memory(std::size_t n_bytes) {
  return ::operator new(n_bytes, kAlignment);
}
void return_memory(void* memory, std::size_t) noexcept {
  ::operator delete(memory, kAlignment);
}
void return_end_of_memory(void*, std::size_t, std::size_t) noexcept {}

#endif

}  // namespace superfacets
