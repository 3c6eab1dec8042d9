// Multi-source shortest paths from all centers, on several threads.
#pragma once

#include "cells/ordered_graph.hpp"
#include "paths/bucket_queue.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

inline constexpr PathLength kUnreached = std::numeric_limits<PathLength>::max();

// A path from a center to a cell. The best path is the shortest, or the path with the lowest label
// if several are equally short. So the best path does not depend on the order of comparisons.
struct Path {
  PathLength length = kUnreached;
  Label label = kNoLabel;  // index of the center

  bool is_better_than(const Path& other) const {
    return length < other.length || (length == other.length && label < other.label);
  }
};

// The path to each cell, in the order of the cells of a graph.
struct PathArrays {
  explicit PathArrays(std::size_t n_cells) : lengths(n_cells), labels(n_cells) {}

  Buffer<PathLength> lengths;  // (N,) length of the path to each cell
  Buffer<Label> labels;        // (N,) label of the path to each cell
};

// Computes the best path to every cell from all centers started so far. The cells are split into
// chunks: consecutive cells on the space-filling curve that fit into a cache. A thread takes a
// chunk and extends all paths within the chunk. Paths that leave the chunk are sent to other chunks
// as proposals. The run ends when no proposals remain. Then no arc can improve a path, so each cell
// has the best of all paths, regardless of the order of processing.
class Expansion {
 public:
  // Initially, no cell is reached.
  Expansion(const OrderedGraph& graph, ThreadTeam& team);
  // Continues with the paths of another expansion on the same graph, after its last run.
  Expansion(const OrderedGraph& graph, PathArrays&& paths, ThreadTeam& team);

  Path path(Place place) const { return {paths_.lengths[place], paths_.labels[place]}; }

  // Discards all paths.
  void clear();

  // Adds by_label[label] to the length of each path, or discards the path if the value is
  // kUnreached. If a center moves, the value must be the length of the path from the new center to
  // the old center, so that path lengths remain valid upper bounds. Arcs between regions may then
  // improve paths. These improvements are applied by the next run(). The graph must be symmetric.
  void lengthen(std::span<const PathLength> by_label);

  // Adds a center. The path to the center itself has the length 0.
  void start(Place center, Label label) { propose({center, {0, label}}); }

  // Adds a path that was found by another algorithm.
  void propose(Place place, const Path& path) { propose({place, path}); }

  void run();

  PathArrays take_paths() && { return std::move(paths_); }

  // Number of chunks. has_changed(chunk) returns whether a path in the chunk has changed since the
  // last call of clear_changed(chunk).
  std::int64_t n_chunks() const { return static_cast<std::int64_t>(chunks_.size()); }
  std::pair<Place, Place> places(std::int64_t chunk) const;
  bool has_changed(std::int64_t chunk) const { return chunks_[chunk].has_changed; }
  void clear_changed(std::int64_t chunk) { chunks_[chunk].has_changed = false; }

 private:
  struct Proposal {
    Place place;
    Path path;
  };
  struct Chunk {
    std::vector<Place> waiting;  // cells with an improved path that is not yet extended
    bool has_changed = false;
  };
  struct Worker {
    explicit Worker(std::int64_t n_arcs) : queue(n_arcs) {}
    BucketQueue queue;
    RadixHeap heap;
    std::vector<Proposal> proposals;  // improved paths to cells of other chunks
  };

  // A thread may read lengths in a chunk that another thread writes. A length read this way is
  // never too short. If it is too long, a later proposal corrects the result.
  PathLength length(Place place) const {
    return std::atomic_ref(const_cast<PathLength&>(paths_.lengths[place]))
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
  const int chunk_bits_;  // a chunk has 2^chunk_bits_ cells
  PathArrays paths_;      // the best path to each cell
  std::vector<Chunk> chunks_;
  std::vector<std::int64_t> active_;  // chunks with waiting cells
  const bool has_few_arcs_;           // whether cells have at most kRow arcs on average
  std::vector<Worker> workers_;       // working memory of each thread
};

}  // namespace superfacets
