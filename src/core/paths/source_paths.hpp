// Shortest paths from one place, as far as they are wanted.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "base/assert.hpp"
#include "base/buffer.hpp"
#include "cells/ordered_graph.hpp"
#include "paths/bucket_queue.hpp"
#include "paths/expansion.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// Expands one source after the other, by label correction, and by Dijkstra's algorithm where that
// does not work. 8 bytes a cell.
class SourcePaths {
 public:
  explicit SourcePaths(const OrderedGraph& graph)
      : graph_(graph), queue_(graph.n_arcs), lengths_(graph.n_cells()) {
    std::fill(lengths_.begin(), lengths_.end(), kUnreached);
  }

  // Finds the shortest paths from a place along which is_followed(place, length) holds for every
  // place but the last, each with the length of its shortest such path. It may be asked with longer
  // paths before, and must not hold for a longer path where it does not for a shorter one. No paths
  // may be left from the source before.
  template <typename IsFollowed>
  void expand(Place source, const IsFollowed& is_followed) {
    SUPERFACETS_ASSERT(reached_.empty() && heap_.empty());
    queue_.restart(0);
    relax(source, 0, queue_);
    while (!queue_.empty()) {
      if (queue_.n_handled() > kMaxHandled * reached_.size() + kAlwaysHandled) {
        return expand_in_order(is_followed);
      }
      for (const Place place : queue_.take()) {
        const PathLength length = lengths_[place];
        if (!queue_.is_stale(length)) follow(place, length, is_followed, queue_);
      }
    }
  }

  // Calls take(place, length) for each place that was reached, in any order, and forgets its path.
  template <typename Take>
  void take(const Take& take_one) {
    for (const Place place : reached_) take_one(place, std::exchange(lengths_[place], kUnreached));
    reached_.clear();
  }

 private:
  // Places handled, in all and per place reached, beyond which buckets are given up for a heap. On
  // meshes it takes one to two for each.
  static constexpr std::size_t kAlwaysHandled = 1000;
  static constexpr std::size_t kMaxHandled = 4;

  // Dijkstra's algorithm from all places in the queue.
  template <typename IsFollowed>
  void expand_in_order(const IsFollowed& is_followed) {
    heap_.restart();
    queue_.drain([&](Place place) { heap_.push(lengths_[place], place); });
    while (!heap_.empty()) {
      const auto [length, place] = heap_.pop();
      if (length == lengths_[place]) follow(place, length, is_followed, heap_);
    }
  }

  template <typename IsFollowed, typename Queue>
  void follow(Place place, PathLength length, const IsFollowed& is_followed, Queue& queue) {
    if (!is_followed(place, length)) return;
    for (const Arc& arc : graph_.arcs_of(place)) {
      relax(arc.to, length + static_cast<PathLength>(arc.length), queue);
    }
  }

  template <typename Queue>
  void relax(Place place, PathLength length, Queue& queue) {
    if (length >= lengths_[place]) return;
    if (lengths_[place] == kUnreached) reached_.push_back(place);
    lengths_[place] = length;
    queue.push(length, place);
  }

  const OrderedGraph& graph_;
  BucketQueue queue_;  // both empty between expansions
  RadixHeap heap_;
  Buffer<PathLength> lengths_;  // (N,) path from the present source; unreached between
  std::vector<Place> reached_;  // by the present source
};

}  // namespace superfacets
