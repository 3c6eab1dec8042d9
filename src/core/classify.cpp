#include "classify.hpp"

#include <algorithm>
#include <limits>
#include <mutex>

#include "bucket_queue.hpp"
#include "parallel.hpp"
#include "radix_heap.hpp"

namespace superfacets {
namespace {

constexpr PathLength kUnreached = std::numeric_limits<PathLength>::max();

// Expansions per cell, beyond which buckets are given up for a heap. On meshes it takes one to two.
constexpr std::int64_t kMaxExpansions = 8;

// Every thread of the halted mode keeps arrays of its own; more would cost memory, not save time.
constexpr int kMaxHaltedThreads = 4;
constexpr std::int64_t kMinCentersPerThread = 16;

Classification without_labels(Cell n_cells, std::span<const Cell> centers) {
  Classification result;
  result.labels.assign(n_cells, kNoLabel);
  result.lengths.assign(n_cells, kUnreached);
  result.centers.assign(centers.begin(), centers.end());
  return result;
}

// Gives a cell the label of a path to it if that path is better. Pairs (length, label) are ordered
// first by length; their minimum over all paths does not depend on the order of this.
bool improve(Classification& result, Cell cell, PathLength length, Label label) {
  const bool better = length < result.lengths[cell] ||
                      (length == result.lengths[cell] && label < result.labels[cell]);
  if (!better) return false;
  result.lengths[cell] = length;
  result.labels[cell] = label;
  return true;
}

// Relaxes the arcs of a cell; the neighbors that improve go into the queue.
template <typename Queue>
void expand(const CellGraph& graph, Cell cell, Queue& queue, Classification& result) {
  const PathLength length = result.lengths[cell];
  const Label label = result.labels[cell];
  for (std::int64_t arc = graph.offsets[cell]; arc < graph.offsets[cell + 1]; ++arc) {
    const Cell neighbor = graph.neighbors[arc];
    const PathLength longer = length + static_cast<PathLength>(graph.lengths[arc]);
    if (improve(result, neighbor, longer, label)) queue.push(longer, neighbor);
  }
}

// Dijkstra's algorithm from all cells in the queue, each of which comes up in order.
void expand_in_order(const CellGraph& graph, BucketQueue& queue, Classification& result) {
  RadixHeap heap;
  while (!queue.empty()) {
    const Cell cell = queue.pop();
    heap.push(result.lengths[cell], cell);
  }
  while (!heap.empty()) {
    const auto [length, cell] = heap.pop();
    if (length == result.lengths[cell]) expand(graph, cell, heap, result);
  }
}

// Shortest paths from all cells in the queue at once. A cell whose label or path improves goes into
// the queue, so when that is empty nothing can improve: each cell has the least pair (length,
// label) over all paths, in whatever order cells came.
void expand_all(const CellGraph& graph, BucketQueue& queue, Classification& result) {
  const std::int64_t n_allowed = kMaxExpansions * static_cast<std::int64_t>(graph.n_cells());
  for (std::int64_t n_expanded = 0; !queue.empty(); ++n_expanded) {
    if (n_expanded > n_allowed) return expand_in_order(graph, queue, result);
    const Cell cell = queue.pop();
    if (!queue.is_stale(result.lengths[cell])) expand(graph, cell, queue, result);
  }
}

void erase_moved(std::span<const Cell> previous_centers, Classification& result) {
  std::vector<std::uint8_t> has_moved;  // (K,)
  has_moved.reserve(previous_centers.size());
  for (std::size_t label = 0; label < previous_centers.size(); ++label) {
    has_moved.push_back(result.centers[label] != previous_centers[label]);
  }
  for (std::size_t cell = 0; cell < result.labels.size(); ++cell) {
    if (!has_moved[result.labels[cell]]) continue;
    result.labels[cell] = kNoLabel;
    result.lengths[cell] = kUnreached;
  }
}

void queue_beside_erased(const CellGraph& graph, const Classification& result, BucketQueue& queue) {
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    if (result.labels[cell] == kNoLabel) continue;
    const auto neighbors =
        graph.neighbors.subspan(graph.offsets[cell], graph.offsets[cell + 1] - graph.offsets[cell]);
    const bool is_beside = std::any_of(neighbors.begin(), neighbors.end(), [&](Cell neighbor) {
      return result.labels[neighbor] == kNoLabel;
    });
    if (is_beside) queue.push(result.lengths[cell], cell);
  }
}

// Expansions of single centers, one after the other.
class HaltedExpansion {
 public:
  HaltedExpansion(const CellGraph& graph, double reach)
      : graph_(graph), squared_reach_(reach * reach), length_(graph.n_cells(), kUnreached) {}

  void run(Cell center, Label label, Classification& result) {
    heap_.restart();
    relax(center, 0);
    while (!heap_.empty()) {
      const auto [length, cell] = heap_.pop();
      if (length == length_[cell] && is_within_reach(center, cell)) expand_from(cell, length);
    }
    for (const Cell cell : touched_) {
      improve(result, cell, length_[cell], label);
      length_[cell] = kUnreached;
    }
    touched_.clear();
  }

 private:
  bool is_within_reach(Cell center, Cell cell) const {
    return squared_norm(graph_.positions[cell] - graph_.positions[center]) <= squared_reach_;
  }

  void expand_from(Cell cell, PathLength length) {
    for (std::int64_t arc = graph_.offsets[cell]; arc < graph_.offsets[cell + 1]; ++arc) {
      relax(graph_.neighbors[arc], length + static_cast<PathLength>(graph_.lengths[arc]));
    }
  }

  void relax(Cell cell, PathLength length) {
    if (length >= length_[cell]) return;
    if (length_[cell] == kUnreached) touched_.push_back(cell);
    length_[cell] = length;
    heap_.push(length, cell);
  }

  const CellGraph& graph_;
  const double squared_reach_;
  RadixHeap heap_;                  // empty between runs
  std::vector<PathLength> length_;  // (N,) path from the present center; unreached between runs
  std::vector<Cell> touched_;       // the cells that this center reached
};

// Keeps the better label of each cell. The order in which parts are merged does not matter.
void merge(const Classification& part, Classification& result) {
  for (std::size_t cell = 0; cell < part.labels.size(); ++cell) {
    if (part.labels[cell] == kNoLabel) continue;
    improve(result, static_cast<Cell>(cell), part.lengths[cell], part.labels[cell]);
  }
}

void adopt_orphans(const CellGraph& graph, double reach, Classification& result) {
  HaltedExpansion expansion(graph, reach);
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    if (result.labels[cell] != kNoLabel) continue;
    const auto label = static_cast<Label>(result.centers.size());
    result.centers.push_back(cell);
    expansion.run(cell, label, result);
  }
}

}  // namespace

Classification classify_exact(const CellGraph& graph, std::span<const Cell> centers) {
  Classification result = without_labels(graph.n_cells(), centers);
  BucketQueue queue(graph);
  for (std::size_t label = 0; label < centers.size(); ++label) {
    improve(result, centers[label], 0, static_cast<Label>(label));
    queue.push(0, centers[label]);
  }
  expand_all(graph, queue, result);
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    if (result.labels[cell] != kNoLabel) continue;
    improve(result, cell, 0, static_cast<Label>(result.centers.size()));
    result.centers.push_back(cell);
    queue.push(0, cell);
    expand_all(graph, queue, result);
  }
  return result;
}

Classification reclassify_exact(const CellGraph& graph, std::span<const Cell> centers,
                                const ClassificationView& previous) {
  Classification result;
  result.labels.assign(previous.labels.begin(), previous.labels.end());
  result.lengths.assign(previous.lengths.begin(), previous.lengths.end());
  result.centers.assign(centers.begin(), centers.end());
  erase_moved(previous.centers, result);

  // Every pair (length, label) that is left belongs to a path from a center that stayed, and
  // between two such cells nothing can improve. What can starts from the new places of centers
  // that moved, or from a cell that is left beside an erased one.
  BucketQueue queue(graph);
  for (std::size_t label = 0; label < centers.size(); ++label) {
    if (centers[label] == previous.centers[label]) continue;
    improve(result, centers[label], 0, static_cast<Label>(label));
    queue.push(0, centers[label]);
  }
  queue_beside_erased(graph, result, queue);
  expand_all(graph, queue, result);
  // Where arcs lead one way only, a center that moved may have left cells that none can reach now.
  const bool has_orphans =
      std::find(result.labels.begin(), result.labels.end(), kNoLabel) != result.labels.end();
  return has_orphans ? classify_exact(graph, centers) : result;
}

Classification classify_halted(const CellGraph& graph, std::span<const Cell> centers, double reach,
                               int n_threads) {
  Classification result = without_labels(graph.n_cells(), centers);
  std::mutex result_mutex;
  auto expand_range = [&](std::int64_t begin, std::int64_t end) {
    HaltedExpansion expansion(graph, reach);
    Classification part = without_labels(graph.n_cells(), {});
    for (std::int64_t label = begin; label < end; ++label) {
      expansion.run(centers[label], static_cast<Label>(label), part);
    }
    const std::scoped_lock lock(result_mutex);
    merge(part, result);
  };
  parallel_ranges(static_cast<std::int64_t>(centers.size()), std::min(n_threads, kMaxHaltedThreads),
                  expand_range, kMinCentersPerThread);
  adopt_orphans(graph, reach, result);
  return result;
}

}  // namespace superfacets
