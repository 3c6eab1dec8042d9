// Connected components of a graph, or of each region in a graph.
#pragma once

#include <numeric>
#include <utility>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

struct Components {
  Buffer<Cell> of;  // (N,) component of each cell, 0..C-1, in the order of their lowest cells
  Cell n_components = 0;
};

// Disjoint sets of cells (union-find). The root of a set is its lowest cell.
class DisjointSets {
 public:
  // Initially each cell is a set of its own.
  explicit DisjointSets(std::size_t n_cells) : parents_(n_cells) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }

  // Returns the root of the united set.
  Cell unite(Cell a, Cell b) {
    a = root(a);
    b = root(b);
    parents_[std::max(a, b)] = std::min(a, b);
    return std::min(a, b);
  }

  // Whether two cells are known to be united, without a search.
  bool share_parent(Cell a, Cell b) const { return parents_[a] == parents_[b]; }

  Cell root(Cell cell) {
    while (parents_[cell] != cell) {
      parents_[cell] = parents_[parents_[cell]];  // halves the path for the next search
      cell = parents_[cell];
    }
    return cell;
  }

  // Numbers the sets in the order of their lowest cells.
  Components number() && {
    Cell n_sets = 0;
    for (std::size_t cell = 0; cell < parents_.size(); ++cell) {
      // A parent is lower than its child, so its entry has already been replaced by its number.
      const auto parent = static_cast<std::size_t>(parents_[cell]);
      parents_[cell] = parent == cell ? n_sets++ : parents_[parent];
    }
    return {std::move(parents_), n_sets};
  }

 private:
  Buffer<Cell> parents_;
};

// Weakly connected components of the regions. Two cells are in one component if a chain of arcs,
// each in either direction, joins them through cells with their label. If all labels are equal, the
// result is the components of the graph. Labels are any integers. for_each_neighbor(cell, take)
// calls take(neighbor) for each arc that leaves a cell. Time O((N + M) log N) at worst, O(N + M) in
// practice. Needs no memory except the result.
template <typename ForEachNeighbor>
Components components_of(std::span<const Label> labels, const ForEachNeighbor& for_each_neighbor) {
  DisjointSets sets(labels.size());
  for (Cell cell = 0; std::cmp_less(cell, labels.size()); ++cell) {
    for_each_neighbor(cell, [&](Cell neighbor) {
      if (labels[neighbor] != labels[cell] || sets.share_parent(cell, neighbor)) return;
      sets.unite(cell, neighbor);
    });
  }
  return std::move(sets).number();
}

Components find_components(const Arcs& arcs, std::span<const Label> labels, ThreadTeam& team);

// Labels and the result are indexed by place; components are numbered in the order of their lowest
// cells.
Components find_components(const OrderedGraph& graph, std::span<const Label> labels);

}  // namespace superfacets
