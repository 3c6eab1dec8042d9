// A queue of places by path length, in buckets: near enough to sorted for label correction to do
// little work twice, and far cheaper than a heap. It keeps no order within a bucket, so a place
// whose path gets shorter after it was expanded has to be expanded again. Where most arcs are much
// shorter than the mean, one bucket holds whole neighborhoods and that has no good bound; whoever
// uses it must watch n_handled, and go on with a RadixHeap.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/assert.hpp"
#include "base/types.hpp"
#include "cells/weights.hpp"

namespace superfacets {

class BucketQueue {
 public:
  // For a graph with so many arcs, whose lengths add up to kTotalBits bits: a bucket is half a mean
  // arc to two wide.
  explicit BucketQueue(std::int64_t n_arcs)
      : width_bits_(std::max(
            0, kTotalBits - static_cast<int>(std::bit_width(static_cast<std::uint64_t>(n_arcs))))),
        ring_(kRingSize) {}

  // Begins anew, with the bucket of the lowest length that will come. The queue must be empty.
  void restart(PathLength lowest) {
    SUPERFACETS_ASSERT(empty());
    current_ = lowest >> width_bits_;
    n_handled_ = 0;
  }

  bool empty() const { return n_near_ == 0 && far_.empty(); }

  // No length may be below those of the bucket that was taken last.
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

  // Removes the first bucket that has any places and returns it: they were pushed with a length of
  // that bucket, and may have a shorter path by now. Valid until the next call. The queue must not
  // be empty.
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

  // Removes all places, in any order.
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

  // Whether a place that was just taken has got a shorter path since it was pushed, by which it was
  // pushed again.
  bool is_stale(PathLength length) const { return length >> width_bits_ != current_; }

  // Places taken, and places looked at for it, since the restart.
  std::size_t n_handled() const { return n_handled_; }

 private:
  struct FarEntry {
    PathLength length;
    Place place;
  };

  // Room for arcs some 500 times the mean.
  static constexpr std::uint64_t kRingSize = 512;

  // Continues with the nearest of the entries that wait, once the ring is empty.
  void bring_near() {
    auto by_length = [](const FarEntry& a, const FarEntry& b) { return a.length < b.length; };
    std::vector<FarEntry> waiting;
    std::swap(waiting, far_);
    n_handled_ += waiting.size();
    current_ = std::min_element(waiting.begin(), waiting.end(), by_length)->length >> width_bits_;
    for (const auto& [length, place] : waiting) push(length, place);
  }

  int width_bits_;                        // a bucket is 2^width_bits_ units wide
  std::vector<std::vector<Place>> ring_;  // bucket b stands at b % kRingSize
  std::vector<FarEntry> far_;             // entries that were beyond the ring
  std::vector<Place> taken_;              // the bucket being worked on
  std::uint64_t current_ = 0;             // the first bucket that may have entries
  std::size_t n_near_ = 0;                // entries in the ring
  std::size_t n_handled_ = 0;
};

}  // namespace superfacets
