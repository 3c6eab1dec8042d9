#include "cells/components.hpp"

namespace superfacets {
namespace {

// Each thread first unites the cells within a block. Blocks write to disjoint entries of the sets,
// because the root of a set is its lowest cell. Arcs between blocks are processed afterwards, on
// one thread. for_each_neighbor(cell, visit) calls visit(neighbor) for the target of each arc.
template <typename ForEach>
Components unite_neighbors(std::span<const Label> labels, const ForEach& for_each_neighbor,
                           ThreadTeam& team) {
  constexpr std::int64_t kBlock = 1 << 14;
  const std::int64_t n_cells = std::ssize(labels);
  DisjointSets sets(labels.size());
  std::vector<std::vector<std::pair<Cell, Cell>>> between((n_cells + kBlock - 1) / kBlock);
  const auto unite_block = [&](std::int64_t begin, std::int64_t end) {
    std::vector<std::pair<Cell, Cell>> leaving;
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      for_each_neighbor(cell, [&, label = labels[cell]](Cell neighbor) {
        if (labels[neighbor] != label) return;
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

}  // namespace

Components find_components(const Arcs& arcs, std::span<const Label> labels, ThreadTeam& team) {
  SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(labels.size(), arcs.n_cells()));
  const auto for_each_neighbor = [&](Cell cell, const auto& visit) {
    for (const Cell neighbor : arcs.neighbors(cell)) visit(neighbor);
  };
  return unite_neighbors(labels, for_each_neighbor, team);
}

Components find_components(const OrderedGraph& graph, std::span<const Label> labels,
                           ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph.n_cells()));
  const auto for_each_neighbor = [&](Place place, const auto& visit) {
    for (const Arc& arc : graph.arcs_of(place)) visit(arc.to);
  };
  Components components = unite_neighbors(labels, for_each_neighbor, team);
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
