// Shortest paths from one place, up to a bound that the caller sets.
#pragma once

#include "cells/ordered_graph.hpp"
#include "paths/bucket_queue.hpp"
#include "paths/expansion.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// Expands one source after another by label correction. After too many steps, Dijkstra's algorithm
// takes over. Memory: 8 bytes per cell.
class SourcePaths {
 public:
  explicit SourcePaths(const OrderedGraph& graph)
      : graph_(graph), queue_(graph.n_arcs), lengths_(graph.n_cells()) {
    std::ranges::fill(lengths_, kUnreached);
  }

  // Finds the shortest paths from `source`. A path continues beyond a place only if
  // is_followed(place, length) holds. is_followed may be called before the shortest path to a place
  // is known; if it holds for a length, it must hold for any lower length. The paths of the
  // previous source must have been taken.
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

  // Calls take_one(place, length) for each place reached, in any order, and clears the path to it.
  template <typename Take>
  void take(const Take& take_one) {
    for (const Place place : reached_) take_one(place, std::exchange(lengths_[place], kUnreached));
    reached_.clear();
  }

 private:
  // Limits of handled places, in total and per place reached. Beyond both, the search switches from
  // buckets to a heap. On meshes a place is handled once or twice.
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
      relax(arc.to, longer_by(length, arc), queue);
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
  BucketQueue queue_;  // the queue and the heap are empty between expansions
  RadixHeap heap_;
  Buffer<PathLength> lengths_;  // (N,) from the current source; kUnreached between searches
  std::vector<Place> reached_;  // places reached from the current source
};

}  // namespace superfacets
