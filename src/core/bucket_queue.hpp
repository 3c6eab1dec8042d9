// A queue of cells by path length, in buckets: near enough to sorted for label correction to do
// little work twice, and far cheaper than a heap. It keeps no order within a bucket, so a cell
// whose path gets shorter after it was expanded has to be expanded again. Where most arcs are much
// shorter than the mean, one bucket holds whole neighborhoods and that has no good bound; whoever
// uses it must count, and go on with a RadixHeap.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>
#include <vector>

#include "types.hpp"
#include "weights.hpp"

namespace superfacets {

class BucketQueue {
 public:
  explicit BucketQueue(const CellGraph& graph)
      : width_bits_(width_bits_for(graph.lengths.size())), ring_(kRingSize) {}

  bool empty() const { return n_near_ == 0 && far_.empty(); }

  void push(PathLength length, Cell cell) {
    const std::uint64_t bucket = length >> width_bits_;
    if (empty()) current_ = bucket;
    // The ring turns on from current_; what lies before it, or more than a turn ahead, waits.
    if (bucket >= current_ && bucket - current_ < kRingSize) {
      ring_[bucket % kRingSize].push_back(cell);
      ++n_near_;
    } else {
      far_.push_back({length, cell});
    }
  }

  // Removes and returns a cell of the first bucket that has any: one that was pushed with a length
  // of that bucket, and may have a shorter path by now. The queue must not be empty.
  Cell pop() {
    if (n_near_ == 0) bring_near();
    while (ring_[current_ % kRingSize].empty()) ++current_;
    auto& bucket = ring_[current_ % kRingSize];
    const Cell cell = bucket.back();
    bucket.pop_back();
    --n_near_;
    return cell;
  }

  // Whether a cell that was just popped has got a shorter path since it was pushed, by which it was
  // pushed again.
  bool is_stale(PathLength length) const { return length >> width_bits_ != current_; }

 private:
  struct FarEntry {
    PathLength length;
    Cell cell;
  };

  // Room for arcs 500 times the mean.
  static constexpr std::uint64_t kRingSize = 4096;

  // Buckets a fourth to a sixteenth of a mean arc wide: all arcs together have kTotalBits bits.
  static int width_bits_for(std::size_t n_arcs) {
    return std::max(0, kTotalBits - 4 - static_cast<int>(std::bit_width(n_arcs)));
  }

  // Continues with the nearest of the entries that wait, once the ring is empty.
  void bring_near() {
    auto by_length = [](const FarEntry& a, const FarEntry& b) { return a.length < b.length; };
    std::vector<FarEntry> waiting;
    std::swap(waiting, far_);
    const auto nearest = std::min_element(waiting.begin(), waiting.end(), by_length);
    std::iter_swap(waiting.begin(), nearest);  // the first that is pushed becomes the current one
    for (const auto& [length, cell] : waiting) push(length, cell);
  }

  int width_bits_;                       // a bucket is 2^width_bits_ units wide
  std::vector<std::vector<Cell>> ring_;  // bucket b stands at b % kRingSize
  std::vector<FarEntry> far_;            // entries outside the present turn of the ring
  std::uint64_t current_ = 0;            // the first bucket that may have entries
  std::size_t n_near_ = 0;               // entries in the ring
};

}  // namespace superfacets
