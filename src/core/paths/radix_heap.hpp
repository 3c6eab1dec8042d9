// A monotone priority queue for integer keys (Ahuja, Mehlhorn, Orlin and Tarjan 1990). Each key
// pushed must be at least the last key popped, as in Dijkstra's algorithm.
#pragma once

#include <array>
#include <bit>

#include "base/assert.hpp"
#include "base/types.hpp"

namespace superfacets {

class RadixHeap {
 public:
  struct Entry {
    PathLength key;
    Place place;
  };

  bool empty() const { return size_ == 0; }

  // Restarts the order at key 0. The heap must be empty.
  void restart() {
    SUPERFACETS_ASSERT(empty());
    last_ = 0;
  }

  void push(PathLength key, Place place) {
    SUPERFACETS_ASSERT(key >= last_);
    buckets_[bucket_of(key)].push_back({key, place});
    ++size_;
  }

  // Removes and returns an entry with the lowest key. The heap must not be empty.
  Entry pop() {
    SUPERFACETS_ASSERT(!empty());
    if (buckets_[0].empty()) refill();
    const Entry entry = buckets_[0].back();
    buckets_[0].pop_back();
    --size_;
    return entry;
  }

 private:
  // Bucket 0 contains keys equal to last_. Bucket b > 0 contains the keys whose highest bit that
  // differs from last_ is bit b - 1.
  std::size_t bucket_of(PathLength key) const { return std::bit_width(key ^ last_); }

  // Moves the entries of the first occupied bucket to lower buckets. Entries with the lowest key
  // move to bucket 0.
  void refill() {
    std::size_t occupied = 1;
    while (buckets_[occupied].empty()) ++occupied;
    auto& entries = buckets_[occupied];
    last_ = std::ranges::min_element(entries, {}, &Entry::key)->key;
    for (const Entry& entry : entries) buckets_[bucket_of(entry.key)].push_back(entry);
    entries.clear();
  }

  std::array<std::vector<Entry>, 65> buckets_;
  PathLength last_ = 0;   // lower bound of all keys in the heap
  std::size_t size_ = 0;  // number of entries in all buckets
};

}  // namespace superfacets
