// Connected components of a graph, or of each region in a graph.
#pragma once

#include <numeric>

#include "cells/ordered_graph.hpp"

namespace superfacets {

struct Components {
  // (N,) component of each cell; components 0..C-1 are sorted by their lowest cell index.
  Buffer<Cell> of;
  Cell n_components = 0;
};

// Disjoint sets of cells (union-find). The root of a set is its lowest cell.
class DisjointSets {
 public:
  // Initially, each set consists of one cell.
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

  // Whether two cells have the same parent. If so, they are already united, and no search is
  // needed.
  bool share_parent(Cell a, Cell b) const { return parents_[a] == parents_[b]; }

  Cell root(Cell cell) {
    while (parents_[cell] != cell) {
      parents_[cell] = parents_[parents_[cell]];  // path halving, for faster searches
      cell = parents_[cell];
    }
    return cell;
  }

  // Numbers the sets in the order of their lowest cell indices.
  Components number() && {
    Cell n_sets = 0;
    for (std::size_t cell = 0; cell < parents_.size(); ++cell) {
      // A parent has a lower index than its child, so the parent's entry has already been replaced
      // by the number of its set.
      const auto parent = static_cast<std::size_t>(parents_[cell]);
      parents_[cell] = parent == cell ? n_sets++ : parents_[parent];
    }
    return {std::move(parents_), n_sets};
  }

 private:
  Buffer<Cell> parents_;
};

// Unites cells with some of their neighbors. for_each_neighbor(cell, visit) must call
// visit(neighbor) for these neighbors. Each thread first unites the cells within a block. Blocks
// write to disjoint entries of the sets, because the root of a set is its lowest cell. Pairs of
// cells in different blocks are united afterwards, on one thread.
template <typename ForEach>
Components unite_neighbors(std::int64_t n_cells, const ForEach& for_each_neighbor,
                           ThreadTeam& team) {
  constexpr std::int64_t kBlock = 1 << 14;
  DisjointSets sets(n_cells);
  std::vector<std::vector<std::pair<Cell, Cell>>> between((n_cells + kBlock - 1) / kBlock);
  const auto unite_block = [&](std::int64_t begin, std::int64_t end) {
    std::vector<std::pair<Cell, Cell>> leaving;
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      for_each_neighbor(cell, [&](Cell neighbor) {
        if (neighbor < begin || neighbor >= end) {
          leaving.emplace_back(cell, neighbor);
        } else if (!sets.share_parent(cell, neighbor)) {
          sets.unite(cell, neighbor);
        }
      });
    }
    between[begin / kBlock] = std::move(leaving);
  };
  team.for_each_block(n_cells, unite_block, kBlock);
  for (const auto& leaving : between) {
    for (const auto& [cell, neighbor] : leaving) sets.unite(cell, neighbor);
  }
  return std::move(sets).number();
}

// Weakly connected components of the regions. Two cells are in one component if an undirected path
// of arcs joins them through cells with the same label. If all labels are equal, the components are
// the components of the graph. Labels can be any integers. The worst-case time is O((N + M) log N);
// in practice it is O(N + M).
Components find_components(const Arcs& arcs, std::span<const Label> labels, ThreadTeam& team);

// Labels and result are in the order of the graph's space-filling curve. Components are numbered in
// the order of their lowest cells, by index in the input.
Components find_components(const OrderedGraph& graph, std::span<const Label> labels,
                           ThreadTeam& team);

}  // namespace superfacets
