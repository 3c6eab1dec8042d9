// Memory for large arrays: uninitialized, and in huge pages where the system has them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#if defined(__linux__)
#include <sys/mman.h>

#include "base/assert.hpp"
#endif

namespace superfacets {

// An array of n uninitialized values. A vector would write zeros first, on one thread, and fault in
// each page of 4 KiB: on meshes of millions of faces that takes longer than most stages. Here each
// thread faults in the pages that it fills.
template <typename T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  Buffer() = default;
  explicit Buffer(std::size_t size) : data_(allocate(size)), size_(size) {}
  Buffer(Buffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { release(data_, size_); }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) {
    SUPERFACETS_ASSERT(i < size_);
    return data_[i];
  }
  const T& operator[](std::size_t i) const {
    SUPERFACETS_ASSERT(i < size_);
    return data_[i];
  }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  std::span<T> span() { return {data_, size_}; }
  std::span<const T> span() const { return {data_, size_}; }

 private:
  static constexpr std::size_t kAlignment = 64;            // a cache line
  static constexpr std::size_t kWorthHugePages = 4 << 20;  // bytes; two huge pages of most systems

  static std::size_t bytes(std::size_t size) {
    // One element at least: numpy wants a valid pointer for an empty array too.
    return std::max<std::size_t>(size, 1) * sizeof(T);
  }

#if defined(__linux__)
  // Allocated by mmap and returned by munmap. With malloc, freed memory that cannot be returned
  // because of a small allocation behind it is a sixth of the peak on a million faces.
  static T* allocate(std::size_t size) {
    const std::size_t n_bytes = bytes(size);
    if (n_bytes < kWorthHugePages) return allocate_small(n_bytes);
    void* data =
        ::mmap(nullptr, n_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED) throw std::bad_alloc();
    ::madvise(data, n_bytes, MADV_HUGEPAGE);  // only advice: where it is refused, pages are small
    return static_cast<T*>(data);
  }

  static void release(T* data, std::size_t size) {
    if (data == nullptr || bytes(size) < kWorthHugePages) return release_small(data);
    ::munmap(data, bytes(size));
  }
#else
  static T* allocate(std::size_t size) { return allocate_small(bytes(size)); }
  static void release(T* data, std::size_t) { release_small(data); }
#endif

  static T* allocate_small(std::size_t n_bytes) {
    return static_cast<T*>(::operator new(n_bytes, std::align_val_t{kAlignment}));
  }
  static void release_small(T* data) { ::operator delete(data, std::align_val_t{kAlignment}); }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace superfacets
