// Shortest paths from all centers at once, on several threads.
#pragma once

#include <limits>

#include "cells/ordered_graph.hpp"
#include "paths/bucket_queue.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

inline constexpr PathLength kUnreached = std::numeric_limits<PathLength>::max();

// A path to a place. The best path is the shortest; ties go to the lowest label. So the best of
// several paths does not depend on the order of comparisons.
struct Path {
  PathLength length = kUnreached;
  Label label = kNoLabel;

  bool is_better_than(const Path& other) const {
    return length < other.length || (length == other.length && label < other.label);
  }
};

// Computes the best path to every place from all centers started so far. The places are split into
// chunks: consecutive places on the space-filling curve that fit into a cache. A thread takes a
// chunk, follows all paths within the chunk, and posts proposals to other chunks for paths that
// leave the chunk. The run ends when no proposals remain. Then no arc can improve a path, so each
// place has the best of all paths, for any order of processing.
class Expansion {
 public:
  // Initially no place is reached.
  Expansion(const OrderedGraph& graph, ThreadTeam& team);

  Path path(Place place) const { return {lengths_[place], labels_[place]}; }

  // Discards all paths.
  void clear();

  // Lengthens all paths of each label by by_label[label], the length of the detour from its new
  // center to its old center, so that paths remain valid upper bounds. The value kUnreached
  // discards the paths. Arcs between regions may then improve paths; the next run applies these
  // improvements. The graph must be symmetric.
  void lengthen(std::span<const PathLength> by_label);

  // Starts a center: a path without arcs, whose length is the offset.
  void start(Place center, Label label, PathLength offset = 0) {
    propose({center, {offset, label}});
  }

  // Sets the paths to all places. Precondition: no arc improves any of them.
  void restore(std::span<const PathLength> lengths, std::span<const Label> labels);

  // Adds a path that was found elsewhere.
  void propose(Place place, const Path& path) { propose({place, path}); }

  void run();

  // Returns the label of each place, and frees the lengths.
  Buffer<Label> take_labels() && {
    lengths_ = {};
    return std::move(labels_);
  }

  // Number of chunks. has_changed(chunk) tells whether a path in the chunk has changed since
  // settle(chunk).
  std::int64_t n_chunks() const { return static_cast<std::int64_t>(chunks_.size()); }
  std::pair<Place, Place> places(std::int64_t chunk) const;
  bool has_changed(std::int64_t chunk) const { return chunks_[chunk].has_changed; }
  void settle(std::int64_t chunk) { chunks_[chunk].has_changed = false; }

 private:
  struct Proposal {
    Place place;
    Path path;
  };
  struct Chunk {
    std::vector<Place> waiting;  // places with an improved path, not yet expanded
    bool has_changed = false;
  };
  struct Worker {
    explicit Worker(std::int64_t n_arcs) : queue(n_arcs) {}
    BucketQueue queue;
    RadixHeap heap;
    std::vector<Proposal> proposals;  // proposals to other chunks
  };

  // A thread may read lengths in a chunk that another thread writes. A length read this way is
  // never too short. If it is too long, a later proposal corrects the result.
  PathLength length(Place place) const {
    return std::atomic_ref(const_cast<PathLength&>(lengths_[place]))
        .load(std::memory_order_relaxed);
  }

  bool improve(Place place, const Path& path);
  void propose(const Proposal& proposal);
  void deliver();
  void lengthen_chunk(std::int64_t chunk, std::span<const PathLength> by_label);
  void compare_labels(std::int64_t chunk, std::span<const PathLength> by_label, Worker& worker);
  void expand_chunk(std::int64_t chunk, Worker& worker);
  void expand_in_order(std::int64_t chunk, Worker& worker);
  template <typename Queue>
  void expand(Place place, std::int64_t chunk, Worker& worker, Queue& queue);
  template <typename Queue>
  void expand_row(Place place, std::int64_t chunk, Worker& worker, Queue& queue);
  template <typename Queue>
  void relax(const Proposal& proposal, std::int64_t chunk, Worker& worker, Queue& queue);

  const OrderedGraph& graph_;
  ThreadTeam& team_;
  const int chunk_bits_;        // a chunk is 2^chunk_bits_ places
  Buffer<PathLength> lengths_;  // (N,)
  Buffer<Label> labels_;        // (N,)
  std::vector<Chunk> chunks_;
  std::vector<std::int64_t> active_;  // chunks with places to expand
  std::vector<Worker> workers_;       // one per thread
};

}  // namespace superfacets
