// Shortest paths from all centers at once, on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <limits>
#include <vector>

#include "cells/ordered_graph.hpp"
#include "paths/bucket_queue.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

inline constexpr PathLength kUnreached = std::numeric_limits<PathLength>::max();

// The best path to a place: the shorter is better, the lower label among equals. The minimum over
// all paths does not depend on the order in which they are compared.
struct Path {
  PathLength length = kUnreached;
  Label label = kNoLabel;

  bool is_better_than(const Path& other) const {
    return length < other.length || (length == other.length && label < other.label);
  }
};

// The best path to every place from the centers started so far, once run. Places are worked on in
// chunks, consecutive places on the curve that fit into a cache: a thread takes a chunk, follows
// all paths that stay in it, and sends word of those that leave it to the chunks they lead to. It
// is over when no word is left; then no arc can improve a path, and each place has the best over
// all paths, in whatever order chunks were worked on.
class Expansion {
 public:
  // Nothing is reached.
  Expansion(const OrderedGraph& graph, ThreadTeam& team);

  Path path(Place place) const { return {lengths_[place], labels_[place]}; }

  // Forgets all paths.
  void clear();

  // Makes every path of a label longer: what it is when its center is that much farther away.
  // kUnreached forgets them. Between labels that differ arcs may then improve paths; the next run
  // sees to it. The graph must be symmetric.
  void lengthen(std::span<const PathLength> by_label);

  // A path of length 0.
  void start(Place center, Label label) { propose({center, {0, label}}); }

  void run();

  // Chunks, and whether paths in them have changed since they were last settled.
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
    std::vector<Place> waiting;  // places whose path has improved and was not followed yet
    bool has_changed = false;
  };
  struct Worker {
    explicit Worker(std::int64_t n_arcs) : queue(n_arcs) {}
    BucketQueue queue;
    RadixHeap heap;
    std::vector<Proposal> proposals;  // for other chunks
  };

  // Several threads read lengths while the one that owns a chunk writes them; that never reads a
  // length too short, and whoever acts on one too long is corrected later.
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
  std::vector<std::int64_t> active_;  // chunks in which places wait
  std::vector<Worker> workers_;       // one per thread
};

}  // namespace superfacets
