// A queue of cells for label-correcting shortest paths, with buckets ordered by path length. The
// queue is much faster than a heap. Cells within a bucket are unordered, so a cell whose path
// becomes shorter after its expansion must be expanded again. On most meshes, few cells are
// expanded twice. If most arcs are much shorter than the mean, a bucket contains whole
// neighborhoods, and the number of repeated expansions may become very large. Callers must
// therefore check n_handled(), and switch to a RadixHeap if it is too large.
#pragma once

#include <bit>

#include "cells/quantization.hpp"

namespace superfacets {

class BucketQueue {
 public:
  // The graph must have n_arcs arcs whose lengths sum to about 2^kTotalBits. The width of a bucket
  // is between 1/8 and 1/2 of the mean length of an arc. In wider buckets, more cells would be
  // expanded twice.
  explicit BucketQueue(std::int64_t n_arcs)
      : width_bits_(std::max(0, kTotalBits - 2 - bits_of(n_arcs))), ring_(kRingSize) {}

  // Restarts the queue; `lowest` is the lowest length that will be pushed. The queue must be empty.
  void restart(PathLength lowest) {
    SUPERFACETS_ASSERT(empty());
    current_ = lowest >> width_bits_;
    n_handled_ = 0;
  }

  bool empty() const { return n_near_ == 0 && far_.empty(); }

  // Pushes a cell. Its path length must not be less than the lower bound of the last bucket taken.
  void push(PathLength length, Place place) {
    const std::uint64_t bucket = length >> width_bits_;
    SUPERFACETS_ASSERT(bucket >= current_);
    if (bucket - current_ < kRingSize) {
      ring_[bucket % kRingSize].push_back(place);
      ++n_near_;
    } else {
      far_.push_back({length, place});
    }
  }

  // Removes the first bucket that is not empty, and returns its cells. Their paths may have become
  // shorter since the cells were pushed. The result is valid until the next call. The queue must
  // not be empty.
  const std::vector<Place>& take() {
    SUPERFACETS_ASSERT(!empty());
    if (n_near_ == 0) bring_near();
    while (ring_[current_ % kRingSize].empty()) ++current_;
    taken_.clear();
    std::swap(taken_, ring_[current_ % kRingSize]);
    n_near_ -= taken_.size();
    n_handled_ += taken_.size();
    return taken_;
  }

  // Removes all cells, and calls visit(place) for each cell, in any order.
  template <typename Visit>
  void drain(const Visit& visit) {
    for (auto& bucket : ring_) {
      for (const Place place : bucket) visit(place);
      bucket.clear();
    }
    for (const FarEntry& entry : far_) visit(entry.place);
    far_.clear();
    n_near_ = 0;
  }

  // Whether an entry of the last bucket is outdated, because its cell later got a shorter path and
  // was pushed again. `length` is the current path length of the cell.
  bool is_stale(PathLength length) const { return length >> width_bits_ != current_; }

  // Number of entries processed since the restart, including far entries moved to the ring.
  std::size_t n_handled() const { return n_handled_; }

 private:
  static int bits_of(std::int64_t n_arcs) {
    return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(n_arcs)));
  }

  struct FarEntry {
    PathLength length;
    Place place;
  };

  // Number of buckets. The ring covers arcs of up to about 100 times the mean length.
  static constexpr std::uint64_t kRingSize = 512;

  // Moves far entries into the empty ring. The new first bucket contains the far entry with the
  // shortest length.
  void bring_near() {
    std::vector<FarEntry> waiting;
    std::swap(waiting, far_);
    n_handled_ += waiting.size();
    current_ = std::ranges::min_element(waiting, {}, &FarEntry::length)->length >> width_bits_;
    for (const auto& [length, place] : waiting) push(length, place);
  }

  int width_bits_;                        // a bucket is 2^width_bits_ units wide
  std::vector<std::vector<Place>> ring_;  // bucket b is ring_[b % kRingSize]
  std::vector<FarEntry> far_;             // entries whose bucket was beyond the ring when pushed
  std::vector<Place> taken_;              // cells of the last bucket taken
  std::uint64_t current_ = 0;             // index of the first bucket that may have entries
  std::size_t n_near_ = 0;                // number of entries in the ring
  std::size_t n_handled_ = 0;             // result of n_handled()
};

}  // namespace superfacets
