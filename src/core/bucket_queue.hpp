// A queue of cells by path length, in buckets: near enough to sorted for Dijkstra's algorithm to do
// little work twice, and far cheaper than a heap. As cells may leave it out of order, a cell whose
// path gets shorter after it was expanded has to be expanded again.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "types.hpp"

namespace superfacets {

class BucketQueue {
 public:
  // A cell and the length of the path by which it was reached, as far as 32 bits hold it: enough to
  // tell, nearly always, that a shorter path was found since.
  struct Entry {
    std::uint32_t low_bits;
    Cell cell;
    bool is_stale(PathLength length) const {
      return low_bits != static_cast<std::uint32_t>(length);
    }
  };

  BucketQueue() : ring_(kRingSize) {}

  bool empty() const { return n_near_ == 0 && far_.empty(); }

  void push(PathLength length, Cell cell) {
    const std::uint64_t bucket = bucket_of(length);
    if (empty()) current_ = std::min(current_, bucket);  // a new expansion starts
    if (bucket - current_ < kRingSize) {
      ring_[bucket % kRingSize].push_back({static_cast<std::uint32_t>(length), cell});
      ++n_near_;
    } else {
      far_.push_back({length, cell});
    }
  }

  // Removes and returns an entry of the first bucket that has any. The queue must not be empty.
  Entry pop() {
    if (n_near_ == 0) bring_near();
    while (ring_[current_ % kRingSize].empty()) ++current_;
    auto& bucket = ring_[current_ % kRingSize];
    const Entry entry = bucket.back();
    bucket.pop_back();
    --n_near_;
    return entry;
  }

 private:
  // An arc of mean weight is 2^20 to 2^21 units long (see quantize_weights), four to eight buckets.
  static constexpr int kWidthBits = 18;
  // Room for arcs 500 times the mean; longer ones wait in far_.
  static constexpr std::uint64_t kRingSize = 4096;

  struct FarEntry {
    PathLength length;
    Cell cell;
  };

  static std::uint64_t bucket_of(PathLength length) { return length >> kWidthBits; }

  // Continues with the nearest of the far entries, once the ring is empty.
  void bring_near() {
    auto by_length = [](const FarEntry& a, const FarEntry& b) { return a.length < b.length; };
    std::vector<FarEntry> waiting;
    std::swap(waiting, far_);
    current_ = bucket_of(std::min_element(waiting.begin(), waiting.end(), by_length)->length);
    for (const auto& [length, cell] : waiting) push(length, cell);
  }

  std::vector<std::vector<Entry>> ring_;  // bucket b stands at b % kRingSize
  std::vector<FarEntry> far_;             // entries that were too far ahead for the ring
  std::uint64_t current_ = 0;             // no entry of the ring is in a bucket before this one
  std::size_t n_near_ = 0;                // entries in the ring
};

}  // namespace superfacets
