// Uninitialized memory for large arrays, in huge pages if the system has them.
#pragma once

#include <cstddef>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {

// Size in bytes of the smallest array that uses take_memory.
inline constexpr std::size_t kLargeMemory = 1 << 16;

// Returns uninitialized memory. On Linux, the memory comes from a pool or from the system, is
// aligned to a page, and is in huge pages if the system supports them. On other systems, the memory
// comes from operator new, aligned to a cache line. Throws std::bad_alloc. May be called on any
// thread, and after a fork.
void* take_memory(std::size_t n_bytes);

// Returns memory to the pool; n_bytes must equal the argument of take_memory. On Linux, the pool
// keeps a limited amount for later calls, and returns any excess to the system.
void return_memory(void* memory, std::size_t n_bytes) noexcept;

// Returns the end of a block of n_bytes to the pool. The first n_kept bytes of the block remain
// valid; n_kept must be at least kLargeMemory. On systems other than Linux, this function has no
// effect.
void return_end_of_memory(void* memory, std::size_t n_bytes, std::size_t n_kept) noexcept;

// An array of uninitialized values. A std::vector would first write zeros on one thread, with a
// page fault for each 4 KiB, which takes longer than most stages on meshes of millions of faces. A
// buffer is filled by several threads, and each thread handles the page faults of its own part.
template <typename T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  using value_type = T;

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

  // Removes values at the end. The remaining values are moved only if they take less than
  // kLargeMemory bytes.
  void shrink(std::size_t size) {
    SUPERFACETS_ASSERT(size <= size_);
    if (bytes(size) < kLargeMemory) {
      Buffer copy(size);
      std::copy_n(data_, size, copy.data_);
      *this = std::move(copy);
    } else {
      return_end_of_memory(data_, bytes(size_), bytes(size));
      size_ = size;
    }
  }
  std::span<const T> span() const { return {data_, size_}; }

 private:
  static constexpr std::align_val_t kAlignment{64};  // size of a cache line in bytes

  static std::size_t bytes(std::size_t size) {
    // Allocates at least one element, because numpy requires a valid pointer even for an empty
    // array.
    return std::max<std::size_t>(size, 1) * sizeof(T);
  }

  // Large arrays do not use malloc. malloc cannot return freed memory to the system while a small
  // allocation follows it in the heap. Using malloc would raise peak memory by a sixth on a million
  // faces.
  static T* allocate(std::size_t size) {
    const std::size_t n_bytes = bytes(size);
    void* data =
        n_bytes < kLargeMemory ? ::operator new(n_bytes, kAlignment) : take_memory(n_bytes);
    return static_cast<T*>(data);
  }

  static void release(T* data, std::size_t size) {
    if (data == nullptr) return;
    if (bytes(size) < kLargeMemory) return ::operator delete(data, kAlignment);
    return_memory(data, bytes(size));
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

template <typename T>
Buffer<T> copy_of(std::span<const T> values) {
  Buffer<T> copy(values.size());
  std::ranges::copy(values, copy.begin());
  return copy;
}

}  // namespace superfacets
