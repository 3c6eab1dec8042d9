// Shortest paths from a single cell, limited by a condition that the caller defines. For shortest
// paths from all centers at once, see expansion.hpp.
#pragma once

#include "paths/expansion.hpp"

namespace superfacets {

// Finds the shortest paths from one source cell after another, with a label-correcting search.
// After too many steps, the search switches to Dijkstra's algorithm. Uses 8 bytes per cell.
class SourcePaths {
 public:
  explicit SourcePaths(const OrderedGraph& graph)
      : graph_(graph), queue_(graph.n_arcs), lengths_(graph.n_cells()) {
    std::ranges::fill(lengths_, kUnreached);
  }

  // Finds the shortest paths from `source`. A path is continued beyond a cell only if
  // is_followed(place, length) is true. `length` may be larger than the final path length. If
  // is_followed is true for a length, it must be true for any lower length. The paths of the
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

  // Calls take_one(place, length) for each reached cell, in any order, and clears all paths.
  template <typename Take>
  void take(const Take& take_one) {
    for (const Place place : reached_) take_one(place, std::exchange(lengths_[place], kUnreached));
    reached_.clear();
  }

 private:
  // Maximum number of processed queue entries: kAlwaysHandled plus kMaxHandled per reached cell.
  // Above this number, the search switches from the bucket queue to a heap. On meshes, a cell is
  // processed once or twice.
  static constexpr std::size_t kAlwaysHandled = 1000;
  static constexpr std::size_t kMaxHandled = 4;

  // Continues with Dijkstra's algorithm, starting from all cells in the queue.
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
    for (const Arc arc : graph_.arcs_of(place)) {
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
  Buffer<PathLength> lengths_;  // (N,) path length from the current source, or kUnreached
  std::vector<Place> reached_;  // cells reached from the current source
};

}  // namespace superfacets
