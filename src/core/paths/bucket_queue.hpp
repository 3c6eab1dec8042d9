// A queue of places for label-correcting shortest paths, with buckets ordered by path length. The
// queue is far cheaper than a heap, and nearly sorted, so few places are expanded twice. Places
// within a bucket are unordered: a place whose path becomes shorter after its expansion must be
// expanded again. If most arcs are much shorter than the mean, a bucket holds whole neighborhoods
// and the number of repeated expansions has no good bound. Callers must watch n_handled and switch
// to a RadixHeap.
#pragma once

#include <bit>

#include "cells/weights.hpp"

namespace superfacets {

class BucketQueue {
 public:
  // For a graph of n_arcs arcs whose lengths sum to about 2^kTotalBits. The width of a bucket is
  // between an eighth and a half of the mean length of an arc: in wider buckets, more places are
  // expanded twice.
  explicit BucketQueue(std::int64_t n_arcs)
      : width_bits_(std::max(0, kTotalBits - 2 - bits_of(n_arcs))), ring_(kRingSize) {}

  // Restarts at the bucket of `lowest`, the lowest length that will be pushed. The queue must be
  // empty.
  void restart(PathLength lowest) {
    SUPERFACETS_ASSERT(empty());
    current_ = lowest >> width_bits_;
    n_handled_ = 0;
  }

  bool empty() const { return n_near_ == 0 && far_.empty(); }

  // Pushes a place. Its length must be at least the lower bound of the last bucket taken.
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

  // Removes the first bucket that is not empty, and returns its places. Their paths may have become
  // shorter since they were pushed. The result is valid until the next call. The queue must not be
  // empty.
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

  // Removes all places, and calls visit(place) for each, in any order.
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

  // Whether an entry just taken is outdated, because its place later got a shorter path and was
  // pushed again. `length` is the current length.
  bool is_stale(PathLength length) const { return length >> width_bits_ != current_; }

  // Number of places taken since the restart, plus the number of places inspected to find them.
  std::size_t n_handled() const { return n_handled_; }

 private:
  static int bits_of(std::int64_t n_arcs) {
    return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(n_arcs)));
  }

  struct FarEntry {
    PathLength length;
    Place place;
  };

  // The ring spans arcs of up to about 100 times the mean length.
  static constexpr std::uint64_t kRingSize = 512;

  // Refills the empty ring from the far entries, starting at the lowest length of a far entry.
  void bring_near() {
    auto by_length = [](const FarEntry& a, const FarEntry& b) { return a.length < b.length; };
    std::vector<FarEntry> waiting;
    std::swap(waiting, far_);
    n_handled_ += waiting.size();
    current_ = std::ranges::min_element(waiting, by_length)->length >> width_bits_;
    for (const auto& [length, place] : waiting) push(length, place);
  }

  int width_bits_;                        // a bucket is 2^width_bits_ units wide
  std::vector<std::vector<Place>> ring_;  // bucket b is ring_[b % kRingSize]
  std::vector<FarEntry> far_;             // entries that were beyond the ring
  std::vector<Place> taken_;              // places of the last bucket taken
  std::uint64_t current_ = 0;             // the first bucket that may have entries
  std::size_t n_near_ = 0;                // entries in the ring
  std::size_t n_handled_ = 0;
};

}  // namespace superfacets
