#include "classify.hpp"

#include <algorithm>
#include <limits>
#include <mutex>

#include "parallel.hpp"
#include "radix_heap.hpp"

namespace superfacets {
namespace {

constexpr PathLength kUnreached = std::numeric_limits<PathLength>::max();

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

// Dijkstra's algorithm from all cells in the heap at once. Arcs are at least 1 unit long, so when a
// cell leaves the heap every path as short as its own has been seen, and its label is final.
void expand_all(const CellGraph& graph, RadixHeap& heap, Classification& result) {
  while (!heap.empty()) {
    const auto [length, cell] = heap.pop();
    if (length != result.lengths[cell]) continue;  // a shorter path was found since
    const Label label = result.labels[cell];
    for (std::int64_t arc = graph.offsets[cell]; arc < graph.offsets[cell + 1]; ++arc) {
      const Cell neighbor = graph.neighbors[arc];
      const PathLength longer = length + static_cast<PathLength>(graph.lengths[arc]);
      const PathLength before = result.lengths[neighbor];
      if (improve(result, neighbor, longer, label) && longer < before) heap.push(longer, neighbor);
    }
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
      if (length != length_[cell]) continue;
      if (is_within_reach(center, cell)) expand(cell, length);
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

  void expand(Cell cell, PathLength length) {
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
  RadixHeap heap;
  for (std::size_t label = 0; label < centers.size(); ++label) {
    improve(result, centers[label], 0, static_cast<Label>(label));
    heap.push(0, centers[label]);
  }
  expand_all(graph, heap, result);
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    if (result.labels[cell] != kNoLabel) continue;
    improve(result, cell, 0, static_cast<Label>(result.centers.size()));
    result.centers.push_back(cell);
    heap.restart();
    heap.push(0, cell);
    expand_all(graph, heap, result);
  }
  return result;
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
