#include "cells/components.hpp"

namespace superfacets {

// Each thread first unites the cells within a block. Blocks write to disjoint entries of the sets,
// because the root of a set is its lowest cell. Arcs between blocks are processed afterwards, on
// one thread.
Components find_components(const Arcs& arcs, std::span<const Label> labels, ThreadTeam& team) {
  SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(labels.size(), arcs.n_cells()));
  constexpr std::int64_t kBlock = 1 << 14;
  DisjointSets sets(labels.size());
  std::vector<std::vector<std::pair<Cell, Cell>>> between((arcs.n_cells() + kBlock - 1) / kBlock);
  const auto unite_block = [&](std::int64_t begin, std::int64_t end) {
    std::vector<std::pair<Cell, Cell>> leaving;
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      for (const Cell neighbor : arcs.neighbors(cell)) {
        if (labels[neighbor] != labels[cell]) continue;
        if (neighbor >= begin && neighbor < end) {
          if (!sets.share_parent(cell, neighbor)) sets.unite(cell, neighbor);
        } else {
          leaving.emplace_back(cell, neighbor);
        }
      }
    }
    between[begin / kBlock] = std::move(leaving);
  };
  team.for_each_block(arcs.n_cells(), unite_block, kBlock);
  for (const auto& leaving : between) {
    for (const auto& [cell, neighbor] : leaving) sets.unite(cell, neighbor);
  }
  return std::move(sets).number();
}

Components find_components(const OrderedGraph& graph, std::span<const Label> labels) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph.n_cells()));
  DisjointSets sets(labels.size());
  for (Place place = 0; place < graph.n_cells(); ++place) {
    for (const Arc& arc : graph.arcs_of(place)) {
      if (labels[arc.to] == labels[place]) sets.unite(place, arc.to);
    }
  }
  Components components = std::move(sets).number();
  // So far, components are numbered in the order of the space-filling curve. The following loop
  // renumbers them in the order of their lowest cells.
  std::vector<Cell> ranks(components.n_components, kNoCell);
  Cell n_ranked = 0;
  for (const Place place : graph.place_of) {
    Cell& rank = ranks[components.of[place]];
    if (rank == kNoCell) rank = n_ranked++;
  }
  for (Cell& component : components.of) component = ranks[component];
  return components;
}

}  // namespace superfacets
